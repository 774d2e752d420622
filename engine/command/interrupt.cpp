// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/command/interrupt.h>

#include <atomic>
#include <csignal>
#include <string_view>

#include <unistd.h>

namespace palpate::command {
namespace {

// Threads of a view ask for them too.
std::atomic<int> asked_signal = 0;   // the signal
std::atomic<bool> only_asks = false; // SignalsOnlyAsk
static_assert(decltype(asked_signal)::is_always_lock_free &&
                  decltype(only_asks)::is_always_lock_free,
              "a signal's handler may not lock");

extern "C" void remember(int signal) {
    asked_signal = signal;
    const std::string_view words =
        only_asks ? "\npalpate: stopping\n" : "\npalpate: stopping; once more to stop at once\n";
    [[maybe_unused]] const auto written = write(STDERR_FILENO, words.data(), words.size());
}

/// Whether who started the command wants it to outlive its terminal, as nohup does.
bool is_ignored(int signal) {
    struct sigaction now {};
    sigaction(signal, nullptr, &now);
    return now.sa_handler == SIG_IGN;
}

/// Lets each of them come to remember(): once, and then do what it always does, or every time.
void listen(int flags) {
    struct sigaction action {};
    action.sa_handler = remember;
    action.sa_flags = flags | SA_RESTART;
    sigemptyset(&action.sa_mask);
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (signal != SIGHUP || !is_ignored(signal)) sigaction(signal, &action, nullptr);
}

} // namespace

void stop_on_signals() { listen(SA_RESETHAND); }

SignalsOnlyAsk::SignalsOnlyAsk() {
    only_asks = true;
    listen(0);
}

SignalsOnlyAsk::~SignalsOnlyAsk() {
    only_asks = false;
    if (asked_signal == 0) {
        stop_on_signals();
        return;
    }
    for (const int signal : {SIGINT, SIGTERM, SIGHUP})
        if (signal != SIGHUP || !is_ignored(signal)) std::signal(signal, SIG_DFL);
}

bool stop_wanted() noexcept { return asked_signal != 0; }

void outlive_readers() { std::signal(SIGPIPE, SIG_IGN); }

void end_by_signal() {
    if (asked_signal == 0) return;
    const int signal = asked_signal;
    std::signal(signal, SIG_DFL);
    std::raise(signal);
}

} // namespace palpate::command
