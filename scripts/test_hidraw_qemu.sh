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
longest=850 # seconds; 20 on a quiet machine

say() { printf 'test_hidraw_qemu.sh: %s\n' "$*"; }
skip() { say "SKIPPED: $*"; exit 77; }

[ -x "$program" ] || { say "$1: no such program; build the target hidraw_guest"; exit 2; }
[ "$(uname -m)" = x86_64 ] || skip "the machine that is simulated is an x86-64, this is $(uname -m)"
command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null || skip "no Debian: its kernel comes as a package of apt-get"

# get COMMAND...: what apt-get says goes to a file; once more with new lists where that may help.
get() {
    "$@" >"$work/apt.log" 2>&1 && return
    [ "$(id -u)" -eq 0 ] && apt-get update -qq >"$work/apt.log" 2>&1 && "$@" >"$work/apt.log" 2>&1
}

install_packages() {
    local missing=()
    command -v qemu-system-x86_64 >/dev/null || missing+=(qemu-system-x86)
    command -v cpio >/dev/null || missing+=(cpio)
    # The shell of the machine needs no libraries.
    dpkg-query -W -f='${db:Status-Abbrev}' busybox-static 2>/dev/null | grep -q '^.i' || missing+=(busybox-static)
    [ ${#missing[@]} -gt 0 ] || return 0
    [ "$(id -u)" -eq 0 ] || skip "${missing[*]} missing; as root: apt-get install --no-install-recommends ${missing[*]}"
    say "installing ${missing[*]}"
    DEBIAN_FRONTEND=noninteractive get apt-get install -y -qq --no-install-recommends "${missing[@]}" ||
        skip "${missing[*]} cannot be installed: $(tail -n 1 "$work/apt.log")"
}

# The package of the kernel that Debian would install now.
kernel_package() { apt-cache depends linux-image-amd64 | grep -o 'linux-image-[0-9][^ ]*' | head -n 1; }

# Unpacked into WORK, not installed; one that is there serves where there are no lists of packages.
fetch_kernel() {
    local package
    package=$(kernel_package 2>/dev/null || true)
    [ -n "$package" ] || package=$(cd "$work" && find . -maxdepth 1 -type d -name 'linux-image-*-amd64' -printf '%f\n' | head -n 1)
    if [ -z "$package" ]; then
        get kernel_package || skip "apt-get knows no linux-image-amd64; as root: apt-get update"
        package=$(cat "$work/apt.log")
    fi
    kernel=$work/$package
    [ ! -d "$kernel" ] || return 0
    say "getting $package"
    get download_kernel "$package" || skip "$package cannot be downloaded: $(tail -n 1 "$work/apt.log")"
}

download_kernel() {
    (cd "$work" && rm -rf ./*.deb part && apt-get download -qq "$1" && dpkg-deb -x "$1"_*.deb part && rm ./*.deb && mv part "$1")
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

# Its serial line, without what only a terminal understands, after a line that says what runs in what.
run_machine() {
    printf '%s, libhidapi-hidraw %s, %s\n' "$(basename "$kernel")" \
        "$(dpkg-query -W -f='${Version}' libhidapi-hidraw0 2>/dev/null)" "$(qemu-system-x86_64 --version | head -n 1)" |
        tee "$log.part"
    timeout "$longest" qemu-system-x86_64 -accel tcg,thread=single -cpu max -m 512 -smp 1 -nodefaults -nographic \
        -serial stdio -no-reboot -kernel "$kernel"/boot/vmlinuz-* -initrd "$work/initrd.gz" \
        -append "console=ttyS0 quiet loglevel=3 panic=-1" </dev/null |
        tr -d '\r' | sed -u 's/\x1b\[[0-9;?]*[A-Za-z]//g; s/\x1bc//g' | sed -u -n '/^kernel /,/^status /p' | tee -a "$log.part"
}

install_packages
fetch_kernel
make_file_system
run_machine || true
mv "$log.part" "$log"
grep -q '^status 0$' "$log" && exit 0
say "FAILED: see $log"
exit 1
