// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/vdb_outline.h>

#include <bit>
#include <set>

// The layout as OpenVDB 2 and later write it: RootNode, InternalNode and LeafNode of
// openvdb/tree (readTopology, readBuffers), and readCompressedValues of openvdb/io/Compression.h.
namespace palpate::internal {
namespace {

constexpr std::uint32_t kZip = 1;
constexpr std::uint32_t kActiveMask = 2;
constexpr std::uint32_t kBlosc = 4;

constexpr std::size_t kUpperNode = 32768;     // values of an internal node below the root
constexpr std::int32_t kUpperNodeEdge = 4096; // voxels
constexpr std::size_t kLowerNode = 4096;
constexpr std::size_t kLeafNode = 512;

/// What stands before a node's values beside the active ones.
enum Inactive : std::int8_t {
    no_mask_background,
    no_mask_minus_background,
    no_mask_one_value,
    mask_and_no_value,
    mask_and_one_value,
    mask_and_two_values,
    no_mask_all_values
};

/// A bit for each value of a node.
template <std::size_t Values>
using Mask = std::array<std::uint64_t, Values / 64>;

template <std::size_t Values>
std::size_t count(const Mask<Values>& mask) {
    std::size_t bits = 0;
    for (const std::uint64_t word : mask)
        bits += static_cast<std::size_t>(std::popcount(word));
    return bits;
}

class TreeWalk {
public:
    TreeWalk(OutlineReader& reader, std::size_t value_bytes, bool half, std::uint32_t compression)
        : reader_(reader), value_bytes_(value_bytes), half_(half), compression_(compression) {}

    void run() {
        if (reader_.number<std::int32_t>() != 1) reader_.fail(); // buffers: more are of OpenVDB 1
        reader_.skip(value_bytes_);                              // background
        const auto tiles = reader_.number<std::uint32_t>();
        const auto children = reader_.number<std::uint32_t>();
        for (std::uint32_t n = 0; n < tiles; ++n) {
            origin();
            reader_.skip(value_bytes_ + 1); // and whether it is active
        }
        for (std::uint32_t n = 0; n < children; ++n) {
            origin();
            upper_node();
        }
        for (const Mask<kLeafNode>& mask : leaves_) {
            // A mask that differs from the one above would make the number of values uncertain.
            if (read_mask<kLeafNode>() != mask) reader_.fail();
            values<kLeafNode>(mask);
        }
    }

private:
    template <std::size_t Values>
    Mask<Values> read_mask() {
        Mask<Values> mask;
        reader_.read(reinterpret_cast<char*>(mask.data()), Values / 8);
        return mask;
    }

    /// Of a node below the root: OpenVDB goes astray in one that is not where such nodes are, and
    /// loses one of two at one place.
    void origin() {
        std::array<std::int32_t, 3> corner{};
        for (std::int32_t& coordinate : corner) {
            coordinate = reader_.number<std::int32_t>();
            if (coordinate % kUpperNodeEdge != 0) reader_.fail();
        }
        if (!origins_.insert(corner).second) reader_.fail();
    }

    void upper_node() {
        const auto children = read_mask<kUpperNode>();
        const auto active = read_mask<kUpperNode>();
        require_apart<kUpperNode>(children, active);
        values<kUpperNode>(active);
        for (std::size_t n = 0; n < count<kUpperNode>(children); ++n)
            lower_node();
    }

    void lower_node() {
        const auto children = read_mask<kLowerNode>();
        const auto active = read_mask<kLowerNode>();
        require_apart<kLowerNode>(children, active);
        values<kLowerNode>(active);
        for (std::size_t n = 0; n < count<kLowerNode>(children); ++n)
            leaves_.push_back(read_mask<kLeafNode>());
    }

    /// What is a child is no active value.
    template <std::size_t Values>
    void require_apart(const Mask<Values>& children, const Mask<Values>& active) const {
        for (std::size_t word = 0; word < children.size(); ++word)
            if ((children[word] & active[word]) != 0) reader_.fail();
    }

    template <std::size_t Values>
    void values(const Mask<Values>& active) {
        const auto inactive = reader_.number<std::int8_t>();
        if (inactive < no_mask_background || inactive > no_mask_all_values) reader_.fail();
        if (inactive == no_mask_one_value || inactive == mask_and_one_value)
            reader_.skip(value_bytes_);
        if (inactive == mask_and_two_values) reader_.skip(2 * value_bytes_);
        if (inactive >= mask_and_no_value && inactive <= mask_and_two_values)
            reader_.skip(Values / 8);
        const bool active_only =
            (compression_ & kActiveMask) != 0 && inactive != no_mask_all_values;
        stored(active_only ? count<Values>(active) : Values);
    }

    void stored(std::size_t numbers) {
        if (half_ && numbers == 0) return;
        const std::size_t bytes = numbers * (half_ ? 2 : value_bytes_);
        if ((compression_ & (kZip | kBlosc)) == 0) return reader_.skip(bytes);
        const auto packed = reader_.number<std::int64_t>();
        if (packed <= 0 && packed != -static_cast<std::int64_t>(bytes)) reader_.fail();
        reader_.skip(packed <= 0 ? bytes : static_cast<std::uint64_t>(packed));
    }

    OutlineReader& reader_;
    std::size_t value_bytes_;
    bool half_;
    std::uint32_t compression_;
    std::set<std::array<std::int32_t, 3>> origins_;
    std::vector<Mask<kLeafNode>> leaves_; ///< active values, in the order of the file
};

} // namespace

void walk_vdb_tree(OutlineReader& reader, std::size_t value_bytes, bool half,
                   std::uint32_t compression) {
    TreeWalk(reader, value_bytes, half, compression).run();
}

} // namespace palpate::internal
