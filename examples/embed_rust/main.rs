// SPDX-License-Identifier: Apache-2.0
//! Palpate in Rust, without a crate: own voxels to the first felt force. A ball of 20 mm, and a
//! probe that comes from the left with 40 mm/s. Prints "250 ms: 0.001 N on ball", and ends with 1
//! where nothing was felt. Against installed libraries:
//!   rustc --edition 2021 -O main.rs -L native=PREFIX/lib && LD_LIBRARY_PATH=PREFIX/lib ./main

/// <palpate/palpate_c.h>, as much of it as is used here. Structs begin with their size; members
/// that a later version adds behind are not missed.
mod c {
    use std::os::raw::{c_char, c_void};

    pub const OK: i32 = 0;
    pub const ABI: u32 = 0;
    pub const BEGAN: i32 = 0;
    pub const MOST_TOUCHES: usize = 96;

    #[repr(C)]
    pub struct Error {
        pub size: usize,
        pub code: i32,
        pub message: [c_char; 1012],
    }
    #[repr(C)]
    pub struct Voxels {
        pub size: usize,
        pub voxels: [i32; 3],
        pub value_count: usize,
        pub values: *const f32,
        pub index_to_scene: [[f64; 4]; 3],
    }
    #[repr(C)]
    pub struct SceneOptions {
        pub size: usize,
        pub cache: *const c_char,
        pub extractor: *const c_void,
        pub progress: *const c_void,
        pub user: *mut c_void,
        pub data: *const Data,
    }
    #[repr(C)]
    pub struct Probe {
        pub size: usize,
        pub time_s: f64,
        pub position_m: [f64; 3],
        pub velocity_m_per_s: [f64; 3],
        pub trial: u32,
        pub buttons: u32,
        pub is_stale: i32,
    }
    #[repr(C)]
    pub struct Frame {
        pub size: usize,
        pub frame: u64,
        pub time_s: f64,
        pub probe_m: [f64; 3],
        pub proxy_m: [f64; 3],
        pub force_n: [f64; 3],
        pub residual_m: f64,
        pub spent_us: f64,
        pub surfaces_felt: u64,
        pub surfaces_open: u64,
        pub surfaces_guarded: u64,
        pub trial: u32,
        pub sub_steps: u32,
        pub evaluations: u32,
        pub contacts: u32,
        pub flags: u32,
        pub field_samples: u32,
        pub surface_queries: u32,
        pub root_queries: u32,
    }
    #[repr(C)]
    #[derive(Clone, Copy)]
    pub struct Touch {
        pub size: usize,
        pub surface: u32,
        pub phase: i32,
        pub point_m: [f64; 3],
        pub normal: [f64; 3],
        pub force_n: [f64; 3],
    }

    // What only a pointer leads to.
    #[repr(C)]
    pub struct Data {
        _private: [u8; 0],
    }
    #[repr(C)]
    pub struct Scene {
        _private: [u8; 0],
    }
    #[repr(C)]
    pub struct Loop {
        _private: [u8; 0],
    }

    #[link(name = "palpate_c")]
    extern "C" {
        pub fn palpate_abi() -> u32;
        pub fn palpate_data_make(data: *mut *mut Data, error: *mut Error) -> i32;
        pub fn palpate_data_free(data: *mut Data);
        pub fn palpate_data_add_voxels(
            data: *mut Data,
            name: *const c_char,
            voxels: *const Voxels,
            error: *mut Error,
        ) -> i32;
        pub fn palpate_scene_parse(
            text: *const c_char,
            name: *const c_char,
            options: *const SceneOptions,
            scene: *mut *mut Scene,
            error: *mut Error,
        ) -> i32;
        pub fn palpate_scene_surface(scene: *const Scene, i: usize) -> *const c_char;
        pub fn palpate_scene_free(scene: *mut Scene);
        pub fn palpate_loop_make(
            scene: *const Scene,
            options: *const c_void,
            made: *mut *mut Loop,
            error: *mut Error,
        ) -> i32;
        pub fn palpate_loop_frame(of: *mut Loop, probe: *const Probe, frame: *mut Frame) -> i32;
        pub fn palpate_loop_touches(
            of: *const Loop,
            touches: *mut Touch,
            capacity: usize,
            count: *mut usize,
        ) -> i32;
        pub fn palpate_loop_free(of: *mut Loop);
    }
}

/// The same in safe Rust: what is made is freed, what fails is a Result.
mod palpate {
    use super::c;
    use std::ffi::{CStr, CString};
    use std::mem::{size_of, zeroed};
    use std::ptr::{null, null_mut};

    /// Does a call and turns what it says into a Result.
    fn checked(call: impl FnOnce(*mut c::Error) -> i32) -> Result<(), String> {
        // All bytes 0 are a struct of C that has all its defaults.
        let mut error: c::Error = unsafe { zeroed() };
        error.size = size_of::<c::Error>();
        if call(&mut error) == c::OK {
            return Ok(());
        }
        let message = unsafe { CStr::from_ptr(error.message.as_ptr()) };
        Err(message.to_string_lossy().into_owned())
    }

    fn text(of: &str) -> Result<CString, String> {
        CString::new(of).map_err(|_| format!("{:?} has a 0 byte; remove it", of))
    }

    pub struct Data(*mut c::Data);

    impl Data {
        pub fn new() -> Result<Data, String> {
            let mut data = null_mut();
            checked(|error| unsafe { c::palpate_data_make(&mut data, error) })?;
            Ok(Data(data))
        }

        /// Voxels of `spacing_m` around the origin, i fastest: copied.
        pub fn add_voxels(
            &mut self,
            name: &str,
            edge: [i32; 3],
            spacing_m: f64,
            values: &[f32],
        ) -> Result<(), String> {
            let mut index_to_scene = [[0.0; 4]; 3];
            for (axis, row) in index_to_scene.iter_mut().enumerate() {
                row[axis] = spacing_m;
                row[3] = -0.5 * spacing_m * f64::from(edge[axis] - 1);
            }
            let voxels = c::Voxels {
                size: size_of::<c::Voxels>(),
                voxels: edge,
                value_count: values.len(),
                values: values.as_ptr(),
                index_to_scene,
            };
            let name = text(name)?;
            checked(|error| unsafe {
                c::palpate_data_add_voxels(self.0, name.as_ptr(), &voxels, error)
            })
        }
    }

    impl Drop for Data {
        fn drop(&mut self) {
            unsafe { c::palpate_data_free(self.0) }
        }
    }

    pub struct Scene(*mut c::Scene);

    // It never changes: any thread may read it, and the last one may free it.
    unsafe impl Send for Scene {}
    unsafe impl Sync for Scene {}

    impl Scene {
        pub fn parse(toml: &str, name: &str, data: &Data) -> Result<Scene, String> {
            let mut options: c::SceneOptions = unsafe { zeroed() };
            options.size = size_of::<c::SceneOptions>();
            options.data = data.0;
            let (toml, name) = (text(toml)?, text(name)?);
            let mut scene = null_mut();
            checked(|error| unsafe {
                c::palpate_scene_parse(toml.as_ptr(), name.as_ptr(), &options, &mut scene, error)
            })?;
            Ok(Scene(scene))
        }

        pub fn surface(&self, i: u32) -> Option<&str> {
            let name = unsafe { c::palpate_scene_surface(self.0, i as usize) };
            if name.is_null() {
                return None;
            }
            unsafe { CStr::from_ptr(name) }.to_str().ok()
        }
    }

    impl Drop for Scene {
        fn drop(&mut self) {
            unsafe { c::palpate_scene_free(self.0) }
        }
    }

    pub struct Loop {
        handle: *mut c::Loop,
        touches: [c::Touch; c::MOST_TOUCHES],
    }

    // One thread at a time calls it, whichever it is.
    unsafe impl Send for Loop {}

    impl Loop {
        pub fn new(scene: &Scene) -> Result<Loop, String> {
            let mut handle = null_mut();
            checked(|error| unsafe {
                c::palpate_loop_make(scene.0, null(), &mut handle, error)
            })?;
            let mut touch: c::Touch = unsafe { zeroed() };
            touch.size = size_of::<c::Touch>();
            Ok(Loop { handle, touches: [touch; c::MOST_TOUCHES] })
        }

        /// The force on the hand, N, scene frame.
        pub fn frame(&mut self, time_s: f64, position_m: [f64; 3]) -> [f64; 3] {
            let mut probe: c::Probe = unsafe { zeroed() };
            probe.size = size_of::<c::Probe>();
            probe.time_s = time_s;
            probe.position_m = position_m;
            let mut frame: c::Frame = unsafe { zeroed() };
            frame.size = size_of::<c::Frame>();
            let code = unsafe { c::palpate_loop_frame(self.handle, &probe, &mut frame) };
            assert_eq!(code, c::OK, "sizes and pointers are right");
            frame.force_n
        }

        /// The contacts of the last frame.
        pub fn touches(&mut self) -> &[c::Touch] {
            let mut count = 0;
            let capacity = self.touches.len();
            let code = unsafe {
                let to = self.touches.as_mut_ptr();
                c::palpate_loop_touches(self.handle, to, capacity, &mut count)
            };
            assert_eq!(code, c::OK, "sizes and pointers are right");
            &self.touches[..count.min(capacity)]
        }
    }

    impl Drop for Loop {
        fn drop(&mut self) {
            unsafe { c::palpate_loop_free(self.handle) }
        }
    }

    pub fn has_right_abi() -> bool {
        unsafe { c::palpate_abi() == c::ABI }
    }
}

const EDGE: i32 = 64;
const BALL: &str = "[volume.scan]\n\
                    [surface.ball]\nvolume = \"scan\"\niso_value = 0\n\
                    [[effect]]\ntype = \"surface\"\nsurface = \"ball\"\n";

/// Depth below the surface of a ball of 20 mm, at voxels of 1 mm: your scan.
fn ball() -> Vec<f32> {
    let mut values = Vec::new();
    let middle = 0.5 * f64::from(EDGE - 1);
    for k in 0..EDGE {
        for j in 0..EDGE {
            for i in 0..EDGE {
                let [x, y, z] = [i, j, k].map(|index| f64::from(index) - middle);
                values.push((20.0 - (x * x + y * y + z * z).sqrt()) as f32);
            }
        }
    }
    values
}

fn first_force() -> Result<(), String> {
    if !palpate::has_right_abi() {
        return Err("libpalpate_c is of another version; compile against its header".into());
    }
    let mut data = palpate::Data::new()?;
    let wrong = data.add_voxels("scan", [EDGE, EDGE, EDGE + 1], 1e-3, &ball());
    assert!(wrong.unwrap_err().contains("value_count"), "a mistake is a Result");
    data.add_voxels("scan", [EDGE; 3], 1e-3, &ball())?;
    let scene = palpate::Scene::parse(BALL, "ball.toml", &data)?;
    drop(data); // the scene keeps what it needs
    let mut felt = palpate::Loop::new(&scene)?;
    for ms in 0..1000 {
        let force_n = felt.frame(1e-3 * f64::from(ms), [0.03 - 4e-5 * f64::from(ms), 0.0, 0.0]);
        if force_n[0] > 0.0 {
            let began = felt.touches().iter().find(|touch| touch.phase == c::BEGAN);
            let name = began.and_then(|touch| scene.surface(touch.surface));
            println!("{} ms: {:.3} N on {}", ms, force_n[0], name.unwrap_or("nothing"));
            return name.map(|_| ()).ok_or_else(|| "a force, and no touch".into());
        }
    }
    Err("nothing was felt".into())
}

fn main() {
    if let Err(message) = first_force() {
        eprintln!("{}", message);
        std::process::exit(1);
    }
}
