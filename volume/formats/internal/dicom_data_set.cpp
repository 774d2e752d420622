// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/dicom_data_set.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <new>
#include <stdexcept>

#include <zlib.h>

#include <palpate/volume/formats/internal/volume_import.h>
#include <palpate/volume/printable.h>

namespace palpate::internal {
namespace {

constexpr DicomTag kMediaStorageClass = 0x00020002;
constexpr DicomTag kTransferSyntax = 0x00020010;
constexpr DicomTag kCharacterSet = 0x00080005;
constexpr DicomTag kStorageClass = 0x00080016;
constexpr DicomTag kItem = 0xFFFEE000;
constexpr DicomTag kItemEnd = 0xFFFEE00D;
constexpr DicomTag kSequenceEnd = 0xFFFEE0DD;
constexpr DicomTag kPixelData = 0x7FE00010;
constexpr std::uint32_t kUndefined = 0xFFFFFFFF;

constexpr std::size_t kPreamble = 128;
constexpr int kMaxDepth = 32;                   // of sequences; real ones have five
constexpr std::size_t kMaxElements = 4'000'000; // 2,000 frames of an enhanced file have 200,000
constexpr std::size_t kMaxPadding = 8192;       // bytes of zero after the last element: a block
constexpr std::size_t kMaxInflated = std::size_t{1} << 32;
constexpr std::size_t kClassWithin = 4096; // bytes: the class stands before all but a few elements
constexpr const char* kDeflatedSyntax = "1.2.840.10008.1.2.1.99";

/// What is wrong, in words that follow the file's name.
struct Damage : std::runtime_error {
    using std::runtime_error::runtime_error;
};

template <class T>
T number_from(const char* from, bool big_endian) noexcept {
    std::array<char, sizeof(T)> part{};
    std::memcpy(part.data(), from, sizeof(T));
    if (big_endian) std::reverse(part.begin(), part.end()); // built for little-endian machines
    return std::bit_cast<T>(part);
}

std::string hex_tag(DicomTag tag) {
    static constexpr const char* kDigits = "0123456789abcdef";
    std::string text = "(";
    for (int nibble = 7; nibble >= 0; --nibble) {
        text += kDigits[tag >> (4 * nibble) & 0xF];
        if (nibble == 4) text += ',';
    }
    return text + ")";
}

DicomSyntax syntax_of(const std::string& uid) {
    DicomSyntax syntax;
    syntax.uid = uid;
    if (uid == "1.2.840.10008.1.2") {
        syntax.explicit_vr = false;
    } else if (uid == "1.2.840.10008.1.2.2") {
        syntax.big_endian = true;
    } else if (uid.starts_with("1.2.840.10008.1.2.4.") || uid == "1.2.840.10008.1.2.5") {
        syntax.compressed = true;
    } else {
        syntax.known = uid == "1.2.840.10008.1.2.1" || uid == kDeflatedSyntax;
    }
    return syntax;
}

bool is_vr(const char* vr) {
    static constexpr std::string_view kKnown =
        "AE AS AT CS DA DS DT FD FL IS LO LT OB OD OF OL OV OW PN SH SL SQ SS ST SV TM UC UI UL UN "
        "UR US UT UV ";
    const std::array<char, 3> with_blank{vr[0], vr[1], ' '};
    const auto found = kKnown.find(std::string_view(with_blank.data(), 3));
    return found != std::string_view::npos && found % 3 == 0;
}

bool has_long_length(std::string_view vr) {
    return std::string_view("OB OD OF OL OV OW SQ SV UC UN UR UT UV").find(vr) !=
           std::string_view::npos;
}

/// Sequences that place and scale the frames of an enhanced file, and those of segments and
/// contours; others are walked only where that is the way to find their end.
bool is_wanted_sequence(DicomTag tag) {
    static constexpr std::array<DicomTag, 18> kWanted{
        0x52009229, 0x52009230, 0x00209113, 0x00209116, 0x00289110, 0x00289145,
        0x00209111, 0x00189114, 0x00189117, 0x00409096, 0x00620002, 0x0062000A,
        0x30060010, 0x30060012, 0x30060014, 0x30060020, 0x30060039, 0x30060040};
    return std::find(kWanted.begin(), kWanted.end(), tag) != kWanted.end();
}

/// Walks bytes from element to element.
class Walk {
public:
    Walk(std::span<const char> bytes, bool explicit_vr, bool big_endian)
        : bytes_(bytes), explicit_vr_(explicit_vr), big_endian_(big_endian) {}

    /// Group 0002 from `start` on, which is always explicit little-endian; returns where it ends.
    std::size_t meta(std::size_t start, DicomDataSet& into) {
        at_ = start;
        DicomTag last = 0;
        while (bytes_.size() - at_ >= 8 && tag_at(at_) >> 16 == 2)
            into.elements.push_back(next_in_order(last));
        return at_;
    }

    /// Everything from `start` to the end. `into` keeps what was found before any damage.
    void data(std::size_t start, DicomDataSet& into) {
        at_ = start;
        into.big_endian = big_endian_;
        DicomTag last = 0;
        while (at_ < bytes_.size()) {
            if (!into.elements.empty() && only_padding_follows()) return;
            into.elements.push_back(next_in_order(last));
        }
    }

private:
    struct Header {
        DicomTag tag = 0;
        std::array<char, 2> vr{' ', ' '};
        std::uint32_t length = 0;
    };

    template <class T>
    T number_at(std::size_t position) const {
        return number_from<T>(bytes_.data() + position, big_endian_);
    }

    DicomTag tag_at(std::size_t position) const {
        return DicomTag{number_at<std::uint16_t>(position)} << 16 |
               number_at<std::uint16_t>(position + 2);
    }

    void require(std::size_t count, const char* what) const {
        if (bytes_.size() - at_ < count)
            throw Damage("is truncated: it ends within " + std::string(what) + " at byte " +
                         std::to_string(at_));
    }

    bool only_padding_follows() const {
        const auto rest = bytes_.subspan(at_);
        return rest.size() <= kMaxPadding &&
               std::all_of(rest.begin(), rest.end(), [](char c) { return c == 0; });
    }

    Header next_header() {
        if (++elements_ > kMaxElements) throw Damage("has more elements than any image");
        require(8, "an element's header");
        Header header;
        header.tag = tag_at(at_);
        const bool has_vr = explicit_vr_ && header.tag >> 16 != 0xFFFE;
        if (!has_vr) {
            header.length = number_at<std::uint32_t>(at_ + 4);
            at_ += 8;
            return header;
        }
        header.vr = {bytes_[at_ + 4], bytes_[at_ + 5]};
        if (!is_vr(header.vr.data()))
            throw Damage("is damaged: no element begins at byte " + std::to_string(at_));
        if (!has_long_length({header.vr.data(), 2})) {
            header.length = number_at<std::uint16_t>(at_ + 6);
            at_ += 8;
            return header;
        }
        require(12, "an element's header");
        header.length = number_at<std::uint32_t>(at_ + 8);
        at_ += 12;
        return header;
    }

    DicomElement next_in_order(DicomTag& last) {
        const std::size_t start = at_;
        DicomElement element = next();
        if (!first_ && element.tag <= last)
            throw Damage("is damaged: at byte " + std::to_string(start) + " element " +
                         hex_tag(element.tag) + " follows " + hex_tag(last));
        first_ = false;
        last = element.tag;
        return element;
    }

    DicomElement next() {
        const Header header = next_header();
        DicomElement element;
        element.tag = header.tag;
        element.vr = header.vr;
        const std::size_t start = at_;
        if (header.length == kUndefined && header.tag == kPixelData) {
            element.encapsulated = true;
            skip_fragments();
        } else if (header.length == kUndefined) {
            read_sequence(header, std::nullopt, element);
        } else {
            require_value(header);
            if (is_wanted_sequence(header.tag))
                read_sequence(header, at_ + header.length, element);
            else
                at_ += header.length;
        }
        element.value = bytes_.subspan(start, at_ - start);
        return element;
    }

    void require_value(const Header& header) const {
        if (bytes_.size() - at_ < header.length)
            throw Damage("is truncated: element " + hex_tag(header.tag) + " has " +
                         std::to_string(bytes_.size() - at_) + " bytes of its " +
                         std::to_string(header.length));
    }

    void read_sequence(const Header& header, std::optional<std::size_t> end,
                       DicomElement& element) {
        if (++depth_ > kMaxDepth) throw Damage("is damaged: its sequences are nested too deeply");
        // What has no known representation is an implicit sequence (PS3.5, 6.2.2).
        const bool explicit_vr = explicit_vr_;
        if (header.vr == std::array{'U', 'N'}) explicit_vr_ = false;
        read_items(end, element);
        explicit_vr_ = explicit_vr;
        --depth_;
    }

    /// Items up to `end`, or to a delimiter where no end is known.
    void read_items(std::optional<std::size_t> end, DicomElement& element) {
        const std::size_t limit = end.value_or(bytes_.size());
        while (at_ < limit) {
            const Header header = next_header();
            if (header.tag == kSequenceEnd && !end) return;
            if (header.tag != kItem)
                throw Damage("is damaged: no item of " + hex_tag(element.tag) +
                             " begins before byte " + std::to_string(at_));
            element.items.push_back(read_item(header.length, limit));
        }
        if (!end) throw Damage("is truncated: it ends within a sequence");
        if (at_ != limit)
            throw Damage("is damaged: the items of " + hex_tag(element.tag) +
                         " do not end where they should");
    }

    DicomDataSet read_item(std::uint32_t length, std::size_t end) {
        if (length != kUndefined && end - at_ < length)
            throw Damage("is truncated: it ends within an item at byte " + std::to_string(at_));
        const std::size_t item_end = length == kUndefined ? end : at_ + length;
        DicomDataSet item;
        item.big_endian = big_endian_;
        while (at_ < item_end) {
            require(8, "an item");
            if (tag_at(at_) == kItemEnd) {
                at_ += 8;
                return item;
            }
            item.elements.push_back(next());
        }
        if (length == kUndefined) throw Damage("is truncated: it ends within an item");
        if (at_ != item_end)
            throw Damage("is damaged: an item's elements do not end where it does, at byte " +
                         std::to_string(item_end));
        return item;
    }

    void skip_fragments() {
        for (;;) {
            const Header header = next_header();
            if (header.tag == kSequenceEnd) return;
            if (header.tag != kItem || header.length == kUndefined)
                throw Damage("is damaged: no fragment of its compressed pixels begins at byte " +
                             std::to_string(at_));
            require(header.length, "its compressed pixels");
            at_ += header.length;
        }
    }

    std::span<const char> bytes_;
    bool explicit_vr_;
    bool big_endian_;
    std::size_t at_ = 0;
    std::size_t elements_ = 0;
    int depth_ = 0;
    bool first_ = true;
};

/// The rest of a file in the deflated syntax.
std::vector<char> inflated(std::span<const char> deflated) {
    z_stream stream{};
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(deflated.data()));
    stream.avail_in = static_cast<uInt>(std::min<std::size_t>(deflated.size(), kUndefined));
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) throw std::bad_alloc();
    std::vector<char> bytes;
    int status = Z_OK;
    try {
        while (status == Z_OK && bytes.size() < kMaxInflated) {
            const std::size_t have = bytes.size();
            bytes.resize(have + std::max<std::size_t>(have / 2, std::size_t{1} << 16));
            stream.next_out = reinterpret_cast<Bytef*>(bytes.data() + have);
            stream.avail_out = static_cast<uInt>(bytes.size() - have);
            status = inflate(&stream, Z_NO_FLUSH);
            bytes.resize(bytes.size() - stream.avail_out);
        }
    } catch (...) {
        inflateEnd(&stream);
        throw;
    }
    inflateEnd(&stream);
    if (status != Z_STREAM_END) throw Damage("is truncated or damaged: it cannot be inflated");
    return bytes;
}

/// Files without a preamble state no syntax: the first element shows whether it has a VR.
DicomSyntax guessed_syntax(std::span<const char> bytes) {
    DicomSyntax syntax;
    syntax.explicit_vr = bytes.size() >= 6 && is_vr(bytes.data() + 4);
    return syntax;
}

void walk(DicomFile& file) {
    const std::size_t start = has_dicom_magic(file.bytes) ? kPreamble + 4 : 0;
    Walk meta(file.bytes, true, false);
    std::size_t end = start;
    if (start > 0 || guessed_syntax(file.bytes).explicit_vr) end = meta.meta(start, file.meta);
    const std::string uid = file.meta.text(kTransferSyntax);
    if (uid.empty()) {
        if (start > 0 && end == file.bytes.size()) throw Damage("is truncated: it has no data set");
        file.syntax = guessed_syntax(std::span(file.bytes).subspan(end));
    } else {
        file.syntax = syntax_of(uid);
    }
    if (!file.syntax.known)
        throw Damage("is in the transfer syntax " + uid.substr(0, 64) + ", which is not read");
    if (uid == kDeflatedSyntax) {
        std::vector<char> data = inflated(std::span(file.bytes).subspan(end));
        file.meta = {}; // its views would dangle; the syntax is all that was wanted
        file.bytes = std::move(data);
        end = 0;
    }
    Walk(file.bytes, file.syntax.explicit_vr, file.syntax.big_endian).data(end, file.data);
    if (file.data.elements.empty()) throw Damage("is truncated: it has no data set");
}

std::string_view without_padding(std::span<const char> value) {
    std::string_view text(value.data(), value.size());
    const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
    while (!text.empty() && is_padding(text.front()))
        text.remove_prefix(1);
    while (!text.empty() && is_padding(text.back()))
        text.remove_suffix(1);
    return text;
}

} // namespace

const DicomElement* DicomDataSet::find(DicomTag tag) const noexcept {
    for (const DicomElement& element : elements)
        if (element.tag == tag) return &element;
    return nullptr;
}

std::string DicomDataSet::text(DicomTag tag) const {
    const DicomElement* const element = find(tag);
    if (element == nullptr) return {};
    std::string text(without_padding(element->value));
    std::replace_if(
        text.begin(), text.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return text;
}

std::optional<std::uint16_t> DicomDataSet::us(DicomTag tag) const noexcept {
    const DicomElement* const element = find(tag);
    if (element == nullptr || element->value.size() < sizeof(std::uint16_t)) return std::nullopt;
    return number_from<std::uint16_t>(element->value.data(), big_endian);
}

std::vector<std::uint16_t> DicomDataSet::shorts(DicomTag tag) const {
    const DicomElement* const element = find(tag);
    if (element == nullptr) return {};
    std::vector<std::uint16_t> numbers(element->value.size() / sizeof(std::uint16_t));
    for (std::size_t n = 0; n < numbers.size(); ++n)
        numbers[n] = number_from<std::uint16_t>(element->value.data() + 2 * n, big_endian);
    return numbers;
}

std::optional<std::uint32_t> DicomDataSet::ul(DicomTag tag) const noexcept {
    const DicomElement* const element = find(tag);
    if (element == nullptr || element->value.size() < sizeof(std::uint32_t)) return std::nullopt;
    return number_from<std::uint32_t>(element->value.data(), big_endian);
}

std::vector<double> DicomDataSet::decimals(DicomTag tag) const {
    const DicomElement* const element = find(tag);
    if (element == nullptr || without_padding(element->value).empty()) return {};
    std::string_view rest(element->value.data(), element->value.size());
    std::vector<double> numbers;
    for (;;) {
        const auto end = rest.find('\\');
        const std::string_view one = rest.substr(0, end);
        const auto number = parsed_number(without_padding({one.data(), one.size()}));
        if (!number) return {};
        numbers.push_back(*number);
        if (end == std::string_view::npos) return numbers;
        rest.remove_prefix(end + 1);
    }
}

std::vector<double> DicomDataSet::doubles(DicomTag tag) const {
    const DicomElement* const element = find(tag);
    if (element == nullptr || element->value.size() % sizeof(double) != 0) return {};
    std::vector<double> numbers;
    for (std::size_t at = 0; at < element->value.size(); at += sizeof(double)) {
        numbers.push_back(number_from<double>(element->value.data() + at, big_endian));
        if (!std::isfinite(numbers.back())) return {};
    }
    return numbers;
}

const DicomDataSet* DicomDataSet::item(DicomTag tag) const noexcept {
    const DicomElement* const element = find(tag);
    return element == nullptr || element->items.empty() ? nullptr : &element->items.front();
}

std::span<const DicomDataSet> DicomDataSet::items(DicomTag tag) const noexcept {
    const DicomElement* const element = find(tag);
    return element == nullptr ? std::span<const DicomDataSet>() : element->items;
}

std::string DicomDataSet::name(DicomTag tag, const DicomDataSet& root) const {
    const DicomElement* const element = find(tag);
    if (element == nullptr) return {};
    const std::string stored(without_padding(element->value)), set = root.text(kCharacterSet);
    if (set == "ISO_IR 192") return printable(stored);
    if (set != "ISO_IR 100") return printable(text(tag));
    std::string utf8; // of Latin-1: one byte or two
    for (const char c : stored) {
        const auto byte = static_cast<unsigned char>(c);
        if (byte >= 0x80) utf8 += static_cast<char>(0xC0 | byte >> 6);
        utf8 += byte >= 0x80 ? static_cast<char>(0x80 | (byte & 0x3F)) : c;
    }
    return printable(utf8);
}

bool has_dicom_magic(std::span<const char> beginning) noexcept {
    return beginning.size() >= kPreamble + 4 &&
           std::memcmp(beginning.data() + kPreamble, "DICM", 4) == 0;
}

bool begins_as_dicom(std::span<const char> beginning) noexcept {
    if (has_dicom_magic(beginning)) return true;
    if (beginning.size() < 8) return false;
    // Little-endian group 0002 or 0008, an element below 0x20, and a length that is not absurd.
    const bool group = (beginning[0] == 2 || beginning[0] == 8) && beginning[1] == 0;
    const bool element = beginning[2] >= 0 && beginning[2] < 0x20 && beginning[3] == 0;
    return group && element && (is_vr(beginning.data() + 4) || beginning[7] == 0);
}

DicomFile read_dicom_file(const std::filesystem::path& file) {
    DicomFile result;
    std::ifstream input(file, std::ios::binary);
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(file, error);
    if (!input || error) throw import_error(file, "cannot be opened; check its permissions");
    try {
        result.bytes.resize(static_cast<std::size_t>(size));
        input.read(result.bytes.data(), static_cast<std::streamsize>(size));
        if (!input) throw import_error(file, "cannot be read; get the file again");
        if (size == 0) throw Damage("is empty");
        walk(result);
    } catch (const Damage& damage) {
        result.problem = damage.what();
    } catch (const std::bad_alloc&) {
        throw import_error(file, "does not fit into memory; use fewer or smaller files");
    } catch (const std::length_error&) {
        throw import_error(file, "does not fit into memory; use fewer or smaller files");
    }
    return result;
}

std::string dicom_class_of(const std::filesystem::path& file) {
    std::ifstream input(file, std::ios::binary);
    DicomFile begun;
    begun.bytes.resize(kClassWithin);
    input.read(begun.bytes.data(), static_cast<std::streamsize>(begun.bytes.size()));
    begun.bytes.resize(static_cast<std::size_t>(input.gcount()));
    if (!begins_as_dicom(begun.bytes)) return {};
    try {
        walk(begun);
    } catch (const Damage& cut) { // here, as a rule: what was found before it counts
        begun.problem = cut.what();
    }
    const std::string of_data = begun.data.text(kStorageClass);
    return of_data.empty() ? begun.meta.text(kMediaStorageClass) : of_data;
}

} // namespace palpate::internal
