// SPDX-License-Identifier: Apache-2.0
// Without libFuzzer: gives a target each file of a folder, by name, and some that the file's bytes
// lead to: cut short, with bytes changed, with a piece doubled. Fails where the target refuses
// another number of whole files than it is told.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

namespace {

constexpr int kDamages = 8;   // of each file; PALPATE_FUZZ=1000 makes it a thousand times as many
constexpr int kMostBytes = 6; // that are changed at once

void run(const std::string& bytes) {
    // A copy of its own size: what reads beyond its end is seen.
    const std::vector<std::uint8_t> exact(bytes.begin(), bytes.end());
    LLVMFuzzerTestOneInput(exact.data(), exact.size());
}

} // namespace

int main(int count, char** arguments) {
    if (count != 3) return std::fprintf(stderr, "usage: %s FOLDER REFUSED\n", arguments[0]), 2;
    const int to_refuse = std::atoi(arguments[2]); // of the whole files
    std::vector<std::filesystem::path> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(arguments[1]))
        if (entry.is_regular_file()) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    const char* factor = std::getenv("PALPATE_FUZZ");
    const int damages = kDamages * (factor ? std::max(1, std::atoi(factor)) : 1);
    std::mt19937 random(1);
    int of_use = 0; // files that the target does not refuse altogether
    for (const std::filesystem::path& file : files) {
        std::fprintf(stderr, "%s\n", file.c_str()); // the last one is at fault where it ends here
        const std::string whole = palpate::test::content_of(file);
        palpate::test::taken = 0;
        run(whole);
        of_use += palpate::test::taken > 0 ? 1 : 0;
        for (int n = 0; n < damages && !whole.empty(); ++n) {
            std::string damaged = whole;
            const std::size_t room =
                n % 2 == 0 ? whole.size() : std::min<std::size_t>(whole.size(), 400);
            for (std::size_t k = random() % kMostBytes + 1; k > 0; --k)
                damaged[random() % room] = static_cast<char>(random());
            if (n % 4 == 0) damaged.resize(random() % damaged.size());
            if (n % 4 == 1) { // a piece of it once more
                const std::size_t from = random() % damaged.size();
                damaged.insert(random() % damaged.size(), damaged.substr(from, random() % 64));
            }
            run(damaged);
        }
    }
    const int refused = static_cast<int>(files.size()) - of_use;
    std::printf("%zu files, %d of them refused, as %d are to be\n", files.size(), refused,
                to_refuse);
    return of_use > 0 && refused == to_refuse ? 0 : 1;
}
