// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>
#include <utility>

#include <palpate/geometry/internal/lower_case.h>
#include <palpate/volume/label_volume.h>
#include <palpate/volume/printable.h>

// The part of label_volume.h that finds labels by what a user calls them.
namespace palpate {
namespace {

constexpr std::size_t kMostProposed = 3;
constexpr std::size_t kLongestName = 80; // of what is compared and quoted

/// Insertions, deletions and replacements that turn one text into the other.
std::size_t edit_distance(const std::string& a, const std::string& b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < a.size(); ++i) {
        std::size_t diagonal = row[0];
        row[0] = i + 1;
        for (std::size_t j = 0; j < b.size(); ++j) {
            const std::size_t above = row[j + 1];
            row[j + 1] = std::min({above + 1, row[j] + 1, diagonal + (a[i] == b[j] ? 0 : 1)});
            diagonal = above;
        }
    }
    return row.back();
}

/// "a", "b" and "c": existing names nearest to one that does not exist.
std::string nearest_names(const std::vector<Label>& labels, const std::string& wanted) {
    std::vector<std::pair<std::size_t, std::string>> names;
    std::set<std::string> seen;
    for (const Label& label : labels)
        if (seen.insert(label.name).second)
            names.emplace_back(
                edit_distance(internal::lower_case(label.name.substr(0, kLongestName)),
                              internal::lower_case(wanted)),
                label.name);
    const std::size_t count = std::min(kMostProposed, names.size());
    std::stable_sort(names.begin(), names.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::string text;
    for (std::size_t n = 0; n < count; ++n)
        text += (n == 0 ? "" : n + 1 == count ? " or " : ", ") + names[n].second;
    return text;
}

std::optional<std::int64_t> whole_number(const std::string& text) {
    std::int64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
}

[[noreturn]] void refuse(const std::vector<Label>& labels, const std::string& wanted) {
    if (labels.empty()) throw std::invalid_argument("the volume has no labels, every voxel is 0");
    const std::string shown = printable(wanted.substr(0, kLongestName));
    if (whole_number(wanted)) {
        const auto [lowest, highest] =
            std::minmax_element(labels.begin(), labels.end(),
                                [](const Label& a, const Label& b) { return a.value < b.value; });
        throw std::invalid_argument("no voxel has the label " + shown + "; there are " +
                                    std::to_string(labels.size()) + " labels from " +
                                    std::to_string(lowest->value) + " to " +
                                    std::to_string(highest->value));
    }
    throw std::invalid_argument("no label is called \"" + shown + "\"; did you mean " +
                                nearest_names(labels, shown) + "?");
}

/// Indices of the labels that fulfil a condition.
template <class Condition>
std::vector<std::size_t> labels_where(const std::vector<Label>& labels,
                                      const Condition& condition) {
    std::vector<std::size_t> found;
    for (std::size_t label = 0; label < labels.size(); ++label)
        if (condition(labels[label])) found.push_back(label);
    return found;
}

/// A number may stand for other structures in other layers.
void require_one_name(const std::vector<Label>& labels, const std::vector<std::size_t>& found,
                      const std::string& wanted) {
    for (const std::size_t label : found)
        if (labels[label].name != labels[found.front()].name)
            throw std::invalid_argument("the label " + wanted + " is \"" +
                                        labels[found.front()].name + "\" in one layer and \"" +
                                        labels[label].name + "\" in another; give a name");
}

std::vector<std::size_t> find_one(const std::vector<Label>& labels, const std::string& wanted) {
    auto found = labels_where(labels, [&](const Label& l) { return l.name == wanted; });
    if (!found.empty()) return found;
    if (const auto value = whole_number(wanted)) {
        found = labels_where(labels, [&](const Label& l) { return l.value == *value; });
        require_one_name(labels, found, wanted);
    } else {
        found = labels_where(labels, [&](const Label& l) {
            return internal::lower_case(l.name) == internal::lower_case(wanted);
        });
    }
    if (found.empty()) refuse(labels, wanted);
    return found;
}

} // namespace

std::vector<std::size_t> find_labels(const LabelVolume& volume,
                                     std::span<const std::string> wanted) {
    std::vector<std::size_t> found;
    for (const std::string& one : wanted)
        for (const std::size_t label : find_one(volume.labels, one))
            if (std::find(found.begin(), found.end(), label) == found.end()) found.push_back(label);
    return found;
}

} // namespace palpate
