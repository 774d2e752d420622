// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>

#include <sys/wait.h>

#include "tests/support/temporary_folder.h"

namespace palpate::test {

/// What a command line left.
struct Outcome {
    int status = -1;    ///< exit code
    std::string output; ///< stdout
    std::string errors; ///< stderr
};

/// A folder in which `palpate` is found, as somebody has it who has built a clone: examples/ is
/// there, demo-output/data is there and empty, and a cache of its own.
class CommandFolder {
public:
    CommandFolder() {
        namespace fs = std::filesystem;
        fs::create_directories(folder_ / "bin");
        fs::create_directories(folder_ / "demo-output/data");
        fs::create_symlink(PALPATE_COMMAND, folder_ / "bin/palpate");
        fs::copy(PALPATE_EXAMPLES, folder_ / "examples", fs::copy_options::recursive);
    }

    std::filesystem::path operator/(const std::string& name) const { return folder_ / name; }

    /// Runs a line as a shell would that stands in the folder.
    Outcome run(const std::string& line) const {
        const std::string folder = folder_.path().string();
        make_file(folder_ / "line.sh", line + "\n");
        const std::string shell = "cd '" + folder + "' && PATH='" + folder +
                                  "/bin':\"$PATH\" PALPATE_CACHE='" + folder +
                                  "/cache' bash line.sh > out.txt 2> err.txt < /dev/null";
        const int result = std::system(shell.c_str());
        return {WIFEXITED(result) ? WEXITSTATUS(result) : -1, content_of(folder_ / "out.txt"),
                content_of(folder_ / "err.txt")};
    }

private:
    TemporaryFolder folder_;
};

} // namespace palpate::test
