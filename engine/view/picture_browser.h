// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace palpate {

/// What pictures of a page look like.
struct PictureLook {
    /// Of its colours.
    enum class Scheme : std::uint8_t {
        light, ///< dark on light
        dark   ///< light on dark
    };
    int width = 1280;              ///< pixels, [320, 3840]
    int height = 720;              ///< pixels, [240, 2160]
    Scheme scheme = Scheme::light; ///< of colours
    std::string from;              ///< letter of the side that is seen, A, P, R, L, S or I; empty:
                                   ///< as the page begins
};

/// The browser that takes pictures: $PALPATE_BROWSER, else chromium, chromium-browser or
/// google-chrome in $PATH.                                                                [setup]
/// Throws std::runtime_error saying what to install where there is none.
std::filesystem::path picture_browser();

/// A browser without a window, with a page that plays a recording in it. It draws by a program, not
/// by a graphics card, so that a picture is the same on every machine with this browser.
class PictureBrowser {
public:
    /// False: somebody wants to stop, and every wait ends with std::runtime_error.
    using GoOn = std::function<bool()>;

    /// Starts it with a playback_page(), and waits until that can be drawn. Its profile is a
    /// temporary folder, which goes with it.                                              [setup]
    /// Throws std::runtime_error with the browser's words where that does not come to be.
    PictureBrowser(const std::filesystem::path& program, std::string_view page,
                   const PictureLook& look, GoOn go_on);
    ~PictureBrowser();
    PictureBrowser(const PictureBrowser&) = delete;
    PictureBrowser& operator=(const PictureBrowser&) = delete;

    /// The picture (PNG) of the page's frame `index`, from 0, in all detail that the page has.
    /// [setup] Throws std::runtime_error.
    std::string png(std::size_t index);

private:
    class Session;
    std::unique_ptr<Session> session_;
};

} // namespace palpate
