// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace palpate::test {

/// The numbers of a frames.csv, by the names of its columns.
inline std::map<std::string, std::vector<double>> frame_table(const std::filesystem::path& file) {
    std::ifstream in(file);
    std::string line, word;
    std::vector<std::string> names;
    std::getline(in, line);
    for (std::istringstream words(line); std::getline(words, word, ',');)
        names.push_back(word);
    std::map<std::string, std::vector<double>> table;
    while (std::getline(in, line)) {
        std::istringstream words(line);
        for (const std::string& name : names) {
            std::getline(words, word, ',');
            table[name].push_back(std::strtod(word.c_str(), nullptr));
        }
    }
    return table;
}

/// How long the force of each frame is, N.
inline std::vector<double> force_lengths(std::map<std::string, std::vector<double>> table) {
    const auto &x = table["force_x_n"], &y = table["force_y_n"], &z = table["force_z_n"];
    std::vector<double> lengths(x.size());
    for (std::size_t i = 0; i < x.size(); ++i)
        lengths[i] = std::hypot(x[i], y[i], z[i]);
    return lengths;
}

} // namespace palpate::test
