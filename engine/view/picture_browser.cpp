// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/view/picture_browser.h>

#include <chrono>
#include <cstdlib>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include <unistd.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/text/base64.h>
#include <palpate/engine/text/internal/png_mark.h>
#include <palpate/engine/text/url.h>
#include <palpate/engine/text/whole_file.h>
#include <palpate/engine/view/internal/child_process.h>

namespace palpate {
namespace {

using internal::ChildProcess;
using Json = nlohmann::json;
using std::chrono::seconds;

constexpr seconds kStart{60};    // for the first answer of a browser on a busy machine
constexpr seconds kPage{180};    // until a page with hours of frames can be drawn
constexpr seconds kPicture{120}; // for a picture with some million facets, drawn by a program
constexpr seconds kEnd{5};       // for an end in peace

/// The options of Chromium: no window, no network of its own, a profile of its own, and the same
/// pixels on every machine.
std::vector<std::string> browser_options(const std::filesystem::path& folder) {
    std::vector<std::string> options{
        "--headless",
        "--remote-debugging-pipe",
        "--user-data-dir=" + (folder / "profile").string(),
        "--use-angle=swiftshader",
        "--enable-unsafe-swiftshader",
        "--force-color-profile=srgb",
        "--hide-scrollbars",
        "--disable-lcd-text",
        "--disable-dev-shm-usage", // 64 MB in a container, too little for a picture
        "--disable-background-networking",
        "--disable-component-update",
        "--disable-sync",
        "--disable-quic",
        "--disable-breakpad",
        "--no-first-run",
        "--no-default-browser-check",
    };
    // Chromium's sandbox refuses root. The page is ours, and reaches nothing.
    if (::geteuid() == 0) options.emplace_back("--no-sandbox");
    options.emplace_back("about:blank");
    return options;
}

/// Where its folder is: its socket there may have a path of 107 bytes (sockaddr_un), of which it
/// and our folder's name need 59.
std::filesystem::path folder_for_browser() {
    constexpr std::size_t longest = 48;
    std::error_code error;
    std::filesystem::path usual = std::filesystem::temp_directory_path(error);
    if (error)
        throw std::runtime_error(
            fmt::format("TMPDIR: is no folder for the browser's files ({}); name another one, or "
                        "leave it out",
                        error.message()));
    return usual.string().size() <= longest ? usual : "/tmp";
}

/// Our mark in somebody else's picture, by which we may replace it.
std::string marked_png(std::string png) {
    if (!png.starts_with("\x89PNG") || png.size() < internal::kPngMarkAt)
        throw std::runtime_error("the browser's picture is no PNG");
    return png.insert(internal::kPngMarkAt, internal::kPngMark);
}

} // namespace

std::filesystem::path picture_browser() {
    const char* const given = std::getenv("PALPATE_BROWSER");
    const bool is_given = given != nullptr && *given != '\0';
    std::filesystem::path found =
        is_given ? internal::found_program({given})
                 : internal::found_program({"chromium", "chromium-browser", "google-chrome"});
    if (!found.empty()) return found;
    if (is_given)
        throw std::runtime_error(fmt::format(
            "PALPATE_BROWSER={}: is no program; name a Chromium, or leave it out", given));
    throw std::runtime_error("pictures need a browser, and there is no chromium, chromium-browser "
                             "or google-chrome in PATH; install one (apt-get install chromium), or "
                             "name one with PALPATE_BROWSER");
}

/// The browser's end of the DevTools protocol: JSON messages in both directions, each ended by a 0
/// (https://chromedevtools.github.io/devtools-protocol).
class PictureBrowser::Session {
public:
    Session(const std::filesystem::path& program, std::string_view page, const PictureLook& look,
            GoOn go_on)
        : folder_(folder_for_browser()), program_(program), go_on_(std::move(go_on)),
          // It reads messages at 3, and writes them at 4.
          browser_(program, browser_options(folder_.path()), {3, 4}, folder_.path()) {
        const std::filesystem::path file = folder_.path() / "page.html";
        write_whole_file(file, page);
        const Json target = call("Target.createTarget", {{"url", "about:blank"}}, kStart);
        const Json attached =
            call("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}},
                 kStart);
        session_ = attached.at("sessionId").get<std::string>();
        call("Emulation.setDeviceMetricsOverride",
             {{"width", look.width},
              {"height", look.height},
              {"deviceScaleFactor", 1},
              {"mobile", false}},
             kStart);
        const char* const scheme = look.scheme == PictureLook::Scheme::dark ? "dark" : "light";
        Json media = Json::array();
        media.push_back({{"name", "prefers-color-scheme"}, {"value", scheme}});
        call("Emulation.setEmulatedMedia", {{"features", media}}, kStart);
        open(fmt::format("file://{}#picture&from={}", percent_encoded(file.string()), look.from));
    }
    ~Session() {
        try {
            session_.clear(); // it is the whole browser that is told
            send("Browser.close", Json::object(), kEnd);
            browser_.wait(ChildProcess::Clock::now() + kEnd, go_on_);
        } catch (const std::exception&) {
            return; // it is ended without being asked
        }
    }
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    std::string png(std::size_t index) {
        const Json shown = evaluate(fmt::format("window.palpate.picture({})", index), kPicture);
        if (shown != index)
            throw std::runtime_error(fmt::format(
                "the browser shows {} and not frame {}; write the page anew", shown.dump(), index));
        const Json taken = call("Page.captureScreenshot", {{"format", "png"}}, kPicture);
        return marked_png(bytes_of_base64(taken.at("data").get_ref<const std::string&>()));
    }

private:
    [[noreturn]] void fail(const std::string& what) const {
        const std::string words = browser_.last_words();
        throw std::runtime_error(
            fmt::format("{}: {}{}; see whether it starts by itself, or name another one with "
                        "PALPATE_BROWSER",
                        program_.string(), what, words.empty() ? "" : " (" + words + ")"));
    }

    /// Waits until the page says that it can be asked for pictures.
    void open(const std::string& address) {
        call("Page.navigate", {{"url", address}}, kStart);
        const auto until = ChildProcess::Clock::now() + kPage;
        constexpr std::chrono::milliseconds look{20};
        const Json question = expression("window.palpate?.picture ? 'ready' : "
                                         "document.getElementById('problem')?.textContent ?? ''");
        for (;;) {
            // An error says that the page is not there yet.
            const std::string words = ask("Runtime.evaluate", question, kPage)
                                          .value("/result/result/value"_json_pointer, "");
            if (words == "ready") return;
            if (!words.empty()) fail("its page says: " + words);
            if (ChildProcess::Clock::now() >= until) fail("did not show the page in time");
            std::this_thread::sleep_for(look);
        }
    }

    static Json expression(const std::string& words) {
        return {{"expression", words}, {"awaitPromise", true}, {"returnByValue", true}};
    }

    /// What an expression comes to in the page, a promise's own.
    Json evaluate(const std::string& words, seconds longest) {
        const Json answer = call("Runtime.evaluate", expression(words), longest);
        if (const auto error = answer.find("exceptionDetails"); error != answer.end())
            fail("its page failed: " +
                 error->value("/exception/description"_json_pointer, error->value("text", "")));
        return answer.at("result").value("value", Json());
    }

    void send(const std::string& method, const Json& parameters, seconds longest) {
        Json message{{"id", ++last_}, {"method", method}, {"params", parameters}};
        if (!session_.empty()) message["sessionId"] = session_;
        std::string text = message.dump();
        text += '\0';
        if (!browser_.write(text, ChildProcess::Clock::now() + longest, go_on_)) fail("is gone");
    }

    /// Sends a message, and waits for its answer, which has a "result" or an "error".
    Json ask(const std::string& method, const Json& parameters, seconds longest) {
        send(method, parameters, longest);
        const auto until = ChildProcess::Clock::now() + longest;
        for (;;) {
            Json answer = next(until);
            if (answer.value("id", 0) == last_) return answer; // else: what it tells by itself
        }
    }

    /// The same, of what has to work.
    Json call(const std::string& method, const Json& parameters, seconds longest) {
        const Json answer = ask(method, parameters, longest);
        if (const auto error = answer.find("error"); error != answer.end())
            fail(method + ": " + error->value("message", ""));
        return answer.at("result");
    }

    Json next(ChildProcess::Clock::time_point until) {
        std::size_t searched = 0;
        for (;;) {
            const std::size_t end = heard_.find('\0', searched);
            if (end != std::string::npos) {
                Json message = Json::parse(std::string_view(heard_).substr(0, end));
                heard_.erase(0, end + 1);
                return message;
            }
            searched = heard_.size();
            if (!browser_.read(heard_, until, go_on_))
                fail(ChildProcess::Clock::now() < until ? "has ended" : "does not answer");
        }
    }

    internal::TemporaryFolder folder_; // outlives the browser, which writes into it
    std::filesystem::path program_;
    GoOn go_on_;
    ChildProcess browser_;
    std::string session_; // of the page
    std::string heard_;   // of messages that are not whole yet
    int last_ = 0;        // number of the last message that was sent
};

PictureBrowser::PictureBrowser(const std::filesystem::path& program, std::string_view page,
                               const PictureLook& look, GoOn go_on)
    : session_(std::make_unique<Session>(program, page, look, std::move(go_on))) {}

PictureBrowser::~PictureBrowser() = default;

std::string PictureBrowser::png(std::size_t index) { return session_->png(index); }

} // namespace palpate
