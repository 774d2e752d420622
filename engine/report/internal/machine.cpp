// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/report/internal/machine.h>

#include <fstream>
#include <thread>

#include <sys/utsname.h>

namespace palpate::internal {

Machine this_machine() {
    Machine machine;
    machine.cpu = "unknown";
    std::ifstream info("/proc/cpuinfo");
    for (std::string line; std::getline(info, line);)
        if (line.starts_with("model name")) {
            machine.cpu = line.substr(line.find(':') + 2);
            break;
        }
    machine.cores = std::thread::hardware_concurrency();
    utsname system{};
    uname(&system);
    machine.system = std::string(system.sysname) + " " + system.release;
    return machine;
}

} // namespace palpate::internal
