// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>
#include <stdexcept>

#include <palpate/drivers/internal/hid_descriptor.h>

namespace palpate::internal {
namespace {

// Bounds within which a descriptor is believed; the first two are the kernel's own.
constexpr std::size_t kMaxDescriptorBytes = 4096;
constexpr std::uint32_t kMaxReportBits = 16384 * 8;
constexpr std::size_t kMaxDepth = 32;     // of collections within each other, and of pushed states
constexpr std::size_t kMaxFields = 2048;  // of what we keep
constexpr std::size_t kMaxUsages = 12288; // of one item, as many as the kernel takes

// Types and tags of short items (HID 1.11, 6.2.2).
enum class ItemType : std::uint8_t { main = 0, global = 1, local = 2, reserved = 3 };
constexpr std::uint8_t kInput = 0x8, kOutput = 0x9, kCollection = 0xA, kFeature = 0xB,
                       kEndCollection = 0xC;
constexpr std::uint8_t kUsagePage = 0x0, kLogicalMin = 0x1, kLogicalMax = 0x2, kReportSize = 0x7,
                       kReportId = 0x8, kReportCount = 0x9, kPush = 0xA, kPop = 0xB;
constexpr std::uint8_t kUsage = 0x0, kUsageMin = 0x1, kUsageMax = 0x2;
constexpr std::uint8_t kLongItem = 0xFE;
constexpr std::uint32_t kConstantBit = 1u << 0, kVariableBit = 1u << 1; // of a main item's data

struct Item {
    ItemType type = ItemType::main;
    std::uint8_t tag = 0;
    std::uint8_t bytes = 0;
    std::uint32_t data = 0;
    std::int32_t signed_data = 0;
};

struct GlobalState {
    std::uint16_t usage_page = 0;
    std::int64_t logical_min = 0;
    std::int64_t logical_max_signed = 0;
    std::int64_t logical_max_unsigned = 0;
    std::uint32_t report_size = 0;
    std::uint32_t report_count = 0;
    std::uint8_t report_id = 0;

    // A maximum of one byte FF is 255 where the minimum is not negative: many descriptors, those
    // of mbed boards among them, are written so.
    std::int64_t logical_max() const {
        return logical_min < 0 ? logical_max_signed : logical_max_unsigned;
    }
};

/// A usage as an item gives it: the page comes with it, or is the one in force at the main item.
struct LocalUsage {
    std::uint32_t data = 0;
    bool with_page = false;

    HidUsage on_page(std::uint16_t page) const {
        return with_page ? data : hid_usage(page, static_cast<std::uint16_t>(data));
    }
};

class DescriptorReader {
public:
    DescriptorReader(std::span<const std::uint8_t> bytes, const std::string& name)
        : bytes_(bytes), name_(name) {}

    HidDescriptor read() {
        if (bytes_.empty()) refuse("it is empty");
        if (bytes_.size() > kMaxDescriptorBytes)
            refuse("it has " + std::to_string(bytes_.size()) + " bytes, of at most " +
                   std::to_string(kMaxDescriptorBytes));
        while (next_ < bytes_.size()) {
            item_at_ = next_;
            if (bytes_[next_] == kLongItem) {
                skip_long_item();
                continue;
            }
            const Item item = next_item();
            if (item.type == ItemType::main) take_main(item);
            if (item.type == ItemType::global) take_global(item);
            if (item.type == ItemType::local) take_local(item);
        }
        if (open_ != HidCollection::kNone) refuse("it ends inside a collection");
        if (found_.report_bits.empty()) refuse("it has no reports");
        return std::move(found_);
    }

private:
    [[noreturn]] void refuse(const std::string& what) const {
        throw std::runtime_error(name_ + ": its report descriptor, byte " +
                                 std::to_string(item_at_) + ": " + what +
                                 "; the device cannot be used: update its firmware");
    }

    void skip_long_item() {
        if (next_ + 1 >= bytes_.size()) refuse("a long item is cut off");
        const std::size_t end = next_ + 3 + bytes_[next_ + 1];
        if (end > bytes_.size()) refuse("a long item is cut off");
        next_ = end;
    }

    Item next_item() {
        const std::uint8_t prefix = bytes_[next_++];
        Item item;
        item.bytes = static_cast<std::uint8_t>((prefix & 3u) == 3u ? 4u : prefix & 3u);
        item.type = static_cast<ItemType>(prefix >> 2 & 3u);
        item.tag = prefix >> 4;
        if (item.bytes > bytes_.size() - next_) refuse("an item is cut off");
        for (unsigned i = 0; i < item.bytes; ++i)
            item.data |= static_cast<std::uint32_t>(bytes_[next_ + i]) << 8 * i;
        next_ += item.bytes;
        if (item.bytes == 1) item.signed_data = static_cast<std::int8_t>(item.data);
        if (item.bytes == 2) item.signed_data = static_cast<std::int16_t>(item.data);
        if (item.bytes == 4) item.signed_data = static_cast<std::int32_t>(item.data);
        return item;
    }

    void take_global(const Item& item) {
        switch (item.tag) {
        case kUsagePage:
            if (item.data > 0xFFFF) refuse("a usage page is above FFFF");
            now_.usage_page = static_cast<std::uint16_t>(item.data);
            break;
        case kLogicalMin:
            now_.logical_min = item.signed_data;
            break;
        case kLogicalMax:
            now_.logical_max_signed = item.signed_data;
            now_.logical_max_unsigned = item.data;
            break;
        case kReportSize:
            if (item.data > kMaxReportBits) refuse("a value is wider than any report");
            now_.report_size = item.data;
            break;
        case kReportCount:
            if (item.data > kMaxReportBits) refuse("there are more values than bits in any report");
            now_.report_count = item.data;
            break;
        case kReportId:
            if (item.data == 0 || item.data > 0xFF) refuse("a report's id is not from 1 to 255");
            if (!found_.numbered && !found_.report_bits.empty())
                refuse("some reports have ids and some have not");
            now_.report_id = static_cast<std::uint8_t>(item.data);
            found_.numbered = true;
            break;
        case kPush:
            if (pushed_.size() == kMaxDepth) refuse("states are pushed too deep");
            pushed_.push_back(now_);
            break;
        case kPop:
            if (pushed_.empty()) refuse("a state is popped that was not pushed");
            now_ = pushed_.back();
            pushed_.pop_back();
            break;
        default:
            break; // physical range and unit: nothing here needs them
        }
    }

    void take_local(const Item& item) {
        const LocalUsage usage{item.data, item.bytes == 4};
        if (item.tag == kUsage) {
            if (usages_.size() == kMaxUsages) refuse("an item has too many usages");
            usages_.push_back(usage);
        }
        if (item.tag == kUsageMin) usage_min_ = usage;
        if (item.tag == kUsageMax && usage_min_) {
            take_usage_range(*usage_min_, usage);
            usage_min_.reset();
        }
    }

    void take_usage_range(LocalUsage first, const LocalUsage& last) {
        if (last.data < first.data) return; // the kernel too takes it as empty
        if (last.data - first.data >= kMaxUsages - usages_.size())
            refuse("an item has too many usages");
        for (; first.data <= last.data; ++first.data) {
            usages_.push_back(first);
            if (first.data == std::numeric_limits<std::uint32_t>::max()) break;
        }
    }

    void take_main(const Item& item) {
        switch (item.tag) {
        case kInput:
            take_fields(HidReportKind::input, item.data);
            break;
        case kOutput:
            take_fields(HidReportKind::output, item.data);
            break;
        case kFeature:
            take_fields(HidReportKind::feature, item.data);
            break;
        case kCollection:
            open_collection();
            break;
        case kEndCollection:
            close_collection();
            break;
        default:
            break;
        }
        usages_.clear();
        usage_min_.reset();
    }

    void open_collection() {
        if (depth_ == kMaxDepth) refuse("collections are too deep");
        ++depth_;
        const HidUsage usage = usages_.empty() ? 0 : usages_.front().on_page(now_.usage_page);
        found_.collections.push_back({usage, open_});
        open_ = found_.collections.size() - 1;
    }

    void close_collection() {
        if (open_ == HidCollection::kNone) refuse("a collection ends that has not begun");
        --depth_;
        open_ = found_.collections[open_].parent;
    }

    void take_fields(HidReportKind kind, std::uint32_t flags) {
        if (open_ == HidCollection::kNone) refuse("a value is outside of any collection");
        const std::uint64_t wanted = std::uint64_t{now_.report_size} * now_.report_count;
        std::uint32_t& bits = found_.report_bits[{kind, now_.report_id}];
        if (wanted > kMaxReportBits - bits) refuse("a report is longer than any report may be");
        const std::uint32_t first_bit = bits + (found_.numbered ? 8 : 0);
        bits += static_cast<std::uint32_t>(wanted);

        const bool padding = (flags & kConstantBit) != 0 || usages_.empty();
        if (padding || wanted == 0 || now_.report_size > 32) return;
        HidField field;
        field.kind = kind;
        field.report_id = now_.report_id;
        field.collection = open_;
        field.first_bit = first_bit;
        field.bits = now_.report_size;
        field.logical_min = now_.logical_min;
        field.logical_max = now_.logical_max();
        if ((flags & kVariableBit) == 0) {
            field.array = true;
            field.count = now_.report_count;
            for (const LocalUsage& usage : usages_)
                field.usages.push_back(usage.on_page(now_.usage_page));
            keep(std::move(field));
        } else {
            keep_variables(field);
        }
    }

    // Each value has the next usage; the last usage is that of all the values that remain.
    void keep_variables(HidField field) {
        const std::uint32_t count = now_.report_count;
        for (std::uint32_t i = 0; i < count; i += field.count) {
            const bool last = i + 1 >= usages_.size();
            field.usages = {usages_[last ? usages_.size() - 1 : i].on_page(now_.usage_page)};
            field.count = last ? count - i : 1;
            keep(field);
            field.first_bit += field.bits * field.count;
        }
    }

    void keep(HidField field) {
        if (found_.fields.size() == kMaxFields) refuse("it has too many values");
        found_.fields.push_back(std::move(field));
    }

    std::span<const std::uint8_t> bytes_;
    const std::string& name_;
    std::size_t next_ = 0;
    std::size_t item_at_ = 0;
    GlobalState now_;
    std::vector<GlobalState> pushed_;
    std::vector<LocalUsage> usages_;
    std::optional<LocalUsage> usage_min_;
    std::size_t open_ = HidCollection::kNone;
    std::size_t depth_ = 0;
    HidDescriptor found_;
};

std::uint32_t bit_at(const HidField& field, std::uint32_t index) {
    return field.first_bit + index * field.bits;
}

bool holds(const HidField& field, std::size_t report_bytes, std::uint32_t index) {
    return index < field.count &&
           std::uint64_t{bit_at(field, index)} + field.bits <= std::uint64_t{report_bytes} * 8;
}

} // namespace

std::size_t HidDescriptor::report_bytes(HidReportKind kind, std::uint8_t id) const {
    const auto found = report_bits.find({kind, id});
    return found == report_bits.end() ? 0 : (found->second + 7) / 8 + (numbered ? 1 : 0);
}

std::size_t HidDescriptor::longest_report(HidReportKind kind) const {
    std::size_t longest = 0;
    for (const auto& [report, bits] : report_bits)
        if (report.first == kind) longest = std::max(longest, report_bytes(kind, report.second));
    return longest;
}

bool HidDescriptor::within(const HidField& field, HidUsage collection) const {
    for (std::size_t at = field.collection; at != HidCollection::kNone; at = collections[at].parent)
        if (collections[at].usage == collection) return true;
    return false;
}

const HidField* HidDescriptor::find(HidReportKind kind, HidUsage usage, HidUsage collection) const {
    for (const HidField& field : fields) {
        if (field.kind != kind) continue;
        if (std::find(field.usages.begin(), field.usages.end(), usage) == field.usages.end())
            continue;
        if (collection == 0 || within(field, collection)) return &field;
    }
    return nullptr;
}

HidDescriptor read_hid_descriptor(std::span<const std::uint8_t> bytes, const std::string& name) {
    return DescriptorReader(bytes, name).read();
}

std::optional<std::int64_t> value_of(const HidField& field, std::span<const std::uint8_t> report,
                                     std::uint32_t index) noexcept {
    if (!holds(field, report.size(), index)) return std::nullopt;
    std::uint64_t raw = 0;
    const std::uint32_t first = bit_at(field, index);
    for (std::uint32_t i = 0; i < field.bits; ++i) {
        const std::uint32_t bit = first + i;
        raw |= std::uint64_t{report[bit / 8] >> bit % 8 & 1u} << i;
    }
    const std::uint64_t sign = std::uint64_t{1} << (field.bits - 1);
    if (field.logical_min < 0 && (raw & sign) != 0)
        return static_cast<std::int64_t>(raw) - static_cast<std::int64_t>(sign << 1);
    return static_cast<std::int64_t>(raw);
}

void set_value(const HidField& field, std::span<std::uint8_t> report, std::int64_t value,
               std::uint32_t index) noexcept {
    if (!holds(field, report.size(), index)) return;
    if (field.logical_min < field.logical_max)
        value = std::clamp(value, field.logical_min, field.logical_max);
    const std::uint32_t first = bit_at(field, index);
    for (std::uint32_t i = 0; i < field.bits; ++i) {
        const std::uint32_t bit = first + i;
        const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
        if ((static_cast<std::uint64_t>(value) >> i & 1u) != 0)
            report[bit / 8] = static_cast<std::uint8_t>(report[bit / 8] | mask);
        else
            report[bit / 8] = static_cast<std::uint8_t>(report[bit / 8] & ~mask);
    }
}

std::optional<std::int64_t> choice_of(const HidField& field, HidUsage usage) noexcept {
    const auto found = std::find(field.usages.begin(), field.usages.end(), usage);
    if (found == field.usages.end()) return std::nullopt;
    return field.array ? field.logical_min + (found - field.usages.begin()) : field.logical_max;
}

} // namespace palpate::internal
