#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
# Runs our HID drivers on Debian's real kernel: libhidapi, hidraw, uhid and the USB stack, in a virtual machine without KVM.
#   scripts/test_hidraw_qemu.sh PROGRAM WORK [LOG]
#     PROGRAM  what runs inside: build/release/hidraw_guest
#     WORK     a folder to work in; the kernel's package is kept there
#     LOG      where to put what the machine said; by default WORK/hidraw_qemu.log
# Exit status 0 all passed, 1 something failed, 77 skipped: what is missing is said. As root, missing packages are installed.
set -euo pipefail

[ $# -ge 2 ] || { sed -n 's/^#   //p' "$0" >&2; exit 2; }
program=$(readlink -f "$1")
mkdir -p "$2"
work=$(readlink -f "$2")
log=$(readlink -f "${3:-$work/hidraw_qemu.log}")
longest=400 # seconds; 20 on a quiet machine

say() { printf 'test_hidraw_qemu.sh: %s\n' "$*"; }
skip() { say "SKIPPED: $*"; exit 77; }

[ -x "$program" ] || { say "$1: no such program; build the target hidraw_guest"; exit 2; }
[ "$(uname -m)" = x86_64 ] || skip "the machine that is simulated is an x86-64, this is $(uname -m)"
command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || skip "no Debian: its kernel comes as a package of apt-get"

install_packages() {
    local missing=()
    command -v qemu-system-x86_64 >/dev/null || missing+=(qemu-system-x86)
    command -v cpio >/dev/null || missing+=(cpio)
    # The shell of the machine needs no libraries.
    dpkg-query -W -f='${db:Status-Abbrev}' busybox-static 2>/dev/null | grep -q ^ii || missing+=(busybox-static)
    [ ${#missing[@]} -gt 0 ] || return 0
    [ "$(id -u)" -eq 0 ] || skip "${missing[*]} missing; as root: apt-get install --no-install-recommends ${missing[*]}"
    say "installing ${missing[*]}"
    local env=(env DEBIAN_FRONTEND=noninteractive)
    "${env[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}" >"$work/apt.log" 2>&1 ||
        { "${env[@]}" apt-get update -qq && "${env[@]}" apt-get install -y -qq --no-install-recommends "${missing[@]}"; } \
            >"$work/apt.log" 2>&1 || skip "${missing[*]} cannot be installed: $(tail -n 1 "$work/apt.log")"
}

# The kernel that Debian would install now; unpacked into WORK, not installed.
fetch_kernel() {
    local package
    package=$(apt-cache depends linux-image-amd64 2>/dev/null | sed -n 's/^ *Depends: //p' | head -n 1)
    [ -n "$package" ] || skip "apt-get knows no linux-image-amd64; as root: apt-get update"
    [ -d "$work/$package" ] || {
        say "getting $package"
        (cd "$work" && apt-get download -qq "$package" >"$work/apt.log" 2>&1) ||
            skip "$package cannot be downloaded: $(tail -n 1 "$work/apt.log")"
        dpkg-deb -x "$work/$package"_*.deb "$work/$package.part"
        rm "$work/$package"_*.deb
        mv "$work/$package.part" "$work/$package"
    }
    kernel=$work/$package
}

# In the order of their needs.
modules="drivers/hid/hid drivers/hid/hid-generic drivers/hid/uhid drivers/usb/common/usb-common drivers/usb/core/usbcore
    drivers/hid/usbhid/usbhid drivers/usb/gadget/udc/udc-core fs/configfs/configfs drivers/usb/gadget/libcomposite
    drivers/usb/gadget/function/usb_f_hid drivers/usb/gadget/udc/dummy_hcd"

write_init() {
    cat <<EOT
#!/bin/busybox sh
/bin/busybox --install -s /bin
mount -t proc proc /proc
mount -t sysfs sysfs /sys
mount -t devtmpfs dev /dev
mount -t tmpfs tmp /tmp
for module in $(for module in $modules; do basename "$module"; done | tr '\n' ' '); do insmod /modules/\$module.ko; done
mount -t configfs config /sys/kernel/config
echo
echo "kernel \$(uname -r)"
/bin/guest --gtest_color=no
echo "status \$?"
poweroff -f
EOT
}

# Everything that the machine has: a shell, the program with its libraries, the kernel's modules.
make_file_system() {
    local root=$work/root module library
    rm -rf "$root"
    mkdir -p "$root"/{bin,proc,sys,dev,tmp,modules}
    cp /bin/busybox "$root/bin/busybox"
    cp "$program" "$root/bin/guest"
    for module in $modules; do
        cp "$kernel"/lib/modules/*/kernel/"$module".ko "$root/modules/"
    done
    while read -r library; do
        mkdir -p "$root$(dirname "$library")"
        cp -L "$library" "$root$library"
    done < <(ldd "$program" | grep -o '/[^ ]*' | sort -u)
    write_init >"$root/init"
    chmod +x "$root/init"
    (cd "$root" && find . | cpio -o -H newc --quiet --owner root:root | gzip -1) >"$work/initrd.gz"
}

# Its serial line, without what only a terminal understands.
run_machine() {
    timeout "$longest" qemu-system-x86_64 -accel tcg,thread=single -cpu max -m 512 -smp 1 -nodefaults -nographic \
        -serial stdio -no-reboot -kernel "$kernel"/boot/vmlinuz-* -initrd "$work/initrd.gz" \
        -append "console=ttyS0 quiet panic=-1" </dev/null |
        tr -d '\r' | sed -u 's/\x1b\[[0-9;?]*[A-Za-z]//g; s/\x1bc//g' | sed -u -n '/^kernel /,/^status /p' | tee "$log.part"
}

install_packages
fetch_kernel
make_file_system
run_machine || true
mv "$log.part" "$log"
grep -q '^status 0$' "$log" && exit 0
say "FAILED: see $log"
exit 1
