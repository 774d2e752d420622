// SPDX-License-Identifier: Apache-2.0
#include <palpate/drivers/igtl_reader.h>

#include <algorithm>
#include <utility>

namespace palpate {

IgtlReader::Found IgtlReader::take(std::span<const std::uint8_t>& bytes) {
    if (is_broken_) return Found::broken;
    const auto passed = static_cast<std::size_t>(std::min<std::uint64_t>(passing_, bytes.size()));
    bytes = bytes.subspan(passed);
    passing_ -= passed;
    if (passing_ > 0) return Found::nothing;
    if (!header_) {
        const Found found = take_header(bytes);
        if (!header_) return found;
    }
    return take_body(bytes);
}

/// False: there is not enough yet.
bool IgtlReader::gather(std::span<const std::uint8_t>& bytes, std::size_t wanted) {
    const std::size_t more = std::min(wanted - gathered_.size(), bytes.size());
    gathered_.insert(gathered_.end(), bytes.begin(),
                     bytes.begin() + static_cast<std::ptrdiff_t>(more));
    bytes = bytes.subspan(more);
    return gathered_.size() == wanted;
}

IgtlReader::Found IgtlReader::take_header(std::span<const std::uint8_t>& bytes) {
    if (!gather(bytes, kIgtlHeader)) return Found::nothing;
    header_ = read_igtl_header(std::span<const std::uint8_t, kIgtlHeader>(gathered_));
    gathered_.clear();
    is_broken_ = !header_ || header_->body_bytes > kMostPassedOver;
    if (!is_broken_ && header_->body_bytes <= kMostBody) return Found::nothing;
    passing_ = is_broken_ ? 0 : header_->body_bytes;
    header_.reset();
    return is_broken_ ? Found::broken : Found::passed_over;
}

IgtlReader::Found IgtlReader::take_body(std::span<const std::uint8_t>& bytes) {
    if (!gather(bytes, static_cast<std::size_t>(header_->body_bytes))) return Found::nothing;
    std::optional<IgtlMessage> message = read_igtl_body(*header_, gathered_);
    header_.reset();
    gathered_.clear();
    if (!message) return Found::faulty;
    message_ = std::move(*message);
    return Found::message;
}

} // namespace palpate
