// SPDX-License-Identifier: Apache-2.0
// Recordings of loops, and their frames computed again.
#include <palpate/palpate_c.h>

#include <filesystem>
#include <string>
#include <vector>

#include <palpate/c/internal/call.h>
#include <palpate/c/internal/handles.h>
#include <palpate/engine/record/output_files.h>
#include <palpate/engine/record/recorded_run.h>
#include <palpate/engine/record/recording.h>
#include <palpate/engine/run/trace.h>

namespace {

using namespace palpate::c;

constexpr std::size_t kFirstCheck = sizeof(palpate_check);

void write(const palpate_loop& loop, const std::filesystem::path& file) {
    require(loop.record.has_value(),
            "palpate_loop_write_recording: the loop keeps no frames; make it with "
            "palpate_loop_options.recorded_frames");
    require(
        !loop.record->run().frames.empty(),
        "palpate_loop_write_recording: no frame is kept: none has been computed, or another scene "
        "was adopted before; call palpate_loop_frame() first");
    const palpate::Scene& scene = *loop.recorded;
    const std::vector<std::filesystem::path> outputs{file};
    palpate::check_outputs(outputs, palpate::input_files(scene.description()),
                           palpate::Replace::own);
    palpate::Trace trace;
    static_cast<palpate::Run&>(trace) = loop.record->run();
    palpate::write_recording(file, palpate::recorded(scene, loop.record->overrides(), trace));
}

palpate_check checked(const std::filesystem::path& file, const palpate_scene& scene) {
    palpate_check check{};
    for (const palpate::Recording& hand : palpate::read_recordings(file)) {
        palpate::SceneDescription description = scene.scene->description();
        palpate::apply(palpate::overrides_from_json(hand.overrides), description);
        const palpate::Trace again = palpate::run_again(
            palpate::recorded_scene(hand, file, std::move(description), scene.resources), hand);
        const palpate::RunDifference differing = palpate::difference(hand, again);
        if (check.different == 0 && differing.first)
            check.first_different = check.frames + *differing.first;
        check.frames += again.frames.size();
        check.different += differing.frames;
    }
    return check;
}

} // namespace

uint64_t palpate_loop_recorded_frames(const palpate_loop* loop) {
    return loop != nullptr && loop->record ? loop->record->run().frames.size() : 0;
}

palpate_code palpate_loop_write_recording(const palpate_loop* loop, const char* file,
                                          palpate_error* error) {
    return guarded(error, [&] {
        require(loop != nullptr && file != nullptr,
                "palpate_loop_write_recording: loop or file is NULL");
        write(*loop, file);
    });
}

palpate_code palpate_recording_check(const char* recording, const palpate_scene* scene,
                                     palpate_check* check, palpate_error* error) {
    return guarded(error, [&] {
        require(recording != nullptr && scene != nullptr && check != nullptr,
                "palpate_recording_check: recording, scene or check is NULL");
        require(check->size >= kFirstCheck,
                "palpate_check: size is too small; set it to sizeof(palpate_check)");
        tell(checked(recording, *scene), *check);
    });
}
