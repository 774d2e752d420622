// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/view_page.h>

#include <limits>
#include <stdexcept>

#include <zlib.h>

#include <palpate/engine/text/base64.h>
#include <palpate/engine/text/text_file.h>

// The page's bytes, as they are.
#ifdef PALPATE_VIEW_PAGE
asm(".section .rodata\n"
    ".global palpate_view_page_begin\n.hidden palpate_view_page_begin\n"
    ".global palpate_view_page_end\n.hidden palpate_view_page_end\n"
    "palpate_view_page_begin:\n"
    ".incbin \"" PALPATE_VIEW_PAGE "\"\n"
    "palpate_view_page_end:\n"
    ".byte 0\n"
    ".previous\n");
extern "C" {
__attribute__((visibility("hidden"))) extern const char palpate_view_page_begin[];
__attribute__((visibility("hidden"))) extern const char palpate_view_page_end[];
}
#endif

namespace palpate {
namespace {

constexpr std::string_view kPlace = "<!-- PALPATE-DATA -->"; // where the data go

std::string gzipped(std::string_view bytes) {
    constexpr int kGzip = 15 + 16; // largest window; a gzip header and trailer around it
    constexpr int kMemory = 8;     // zlib's default
    if (bytes.size() > std::numeric_limits<uInt>::max())
        throw std::runtime_error("a page cannot hold more than 4 GB; record a shorter run");
    z_stream stream{};
    if (deflateInit2(&stream, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kGzip, kMemory,
                     Z_DEFAULT_STRATEGY) != Z_OK)
        throw std::bad_alloc();
    std::string out(deflateBound(&stream, static_cast<uLong>(bytes.size())), '\0');
    // zlib's interface is older than const; it does not write there.
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(out.data());
    stream.avail_out = static_cast<uInt>(out.size());
    const int result = deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    if (result != Z_STREAM_END) throw std::runtime_error("zlib did not end");
    return out;
}

} // namespace

std::string_view built_in_page() noexcept {
#ifdef PALPATE_VIEW_PAGE
    return {palpate_view_page_begin, palpate_view_page_end};
#else
    return {};
#endif
}

std::string view_page(const std::filesystem::path& file) {
    if (!file.empty()) {
        std::string page = read_text_file(file, "a page of palpate view (HTML)");
        if (page.find(kPlace) == std::string::npos)
            throw std::runtime_error(file.string() + ": has no place for data, " +
                                     std::string(kPlace) + "; give a palpate_view.html");
        return page;
    }
    if (built_in_page().empty())
        throw std::runtime_error("view: this build has no page in it; build it with npm installed, "
                                 "or give one with --page");
    return std::string(built_in_page());
}

std::string playback_page(std::string_view page, std::string_view container) {
    const std::size_t at = page.find(kPlace);
    if (at == std::string_view::npos)
        throw std::invalid_argument("the page has no place for data, " + std::string(kPlace) +
                                    "; give a palpate_view.html");
    std::string whole(page.substr(0, at));
    whole += "<script type=\"application/octet-stream\" id=\"palpate-data\" "
             "data-encoding=\"gzip+base64\">";
    whole += base64(gzipped(container));
    whole += "</script>";
    whole += page.substr(at + kPlace.size());
    return whole;
}

} // namespace palpate
