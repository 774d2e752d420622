// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/interrupt.h>

#include <csignal>
#include <string_view>

#include <unistd.h>

namespace palpate::command {
namespace {

volatile std::sig_atomic_t asked = 0; // the signal

extern "C" void remember(int signal) {
    asked = signal;
    constexpr std::string_view words = "\npalpate: stopping; once more to stop at once\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, words.data(), words.size());
}

} // namespace

void stop_on_signals() {
    struct sigaction action {};
    action.sa_handler = remember;
    action.sa_flags = SA_RESETHAND | SA_RESTART; // the second one does what it always does
    sigemptyset(&action.sa_mask);
    sigaction(SIGINT, &action, nullptr);
    sigaction(SIGTERM, &action, nullptr);
}

bool stop_wanted() noexcept { return asked != 0; }

void end_by_signal() {
    if (asked == 0) return;
    const int signal = asked;
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

} // namespace palpate::command
