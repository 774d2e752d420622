// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace palpate::command {

/// From now on Ctrl-C (SIGINT), SIGTERM and the end of the terminal (SIGHUP) ask the command to
/// stop at the next step of its progress, so that nothing half-written stays behind; a second one
/// ends it at once. A SIGHUP that is ignored when the command begins stays ignored (nohup).
void stop_on_signals();

/// True once a signal has asked to stop.
bool stop_wanted() noexcept;

/// While it lives a second signal does not end the command at once: a device that is held would be
/// left with its last force. The run that it guards stops on the first.
class SignalsOnlyAsk {
public:
    SignalsOnlyAsk();
    ~SignalsOnlyAsk();
    SignalsOnlyAsk(const SignalsOnlyAsk&) = delete;
    SignalsOnlyAsk& operator=(const SignalsOnlyAsk&) = delete;
};

/// From now on a reader of stdout or stderr that goes away (SIGPIPE) does not end the command: what
/// is written there fails, and a device that is held is let go as it should be.
void outlive_readers();

/// Ends the process by the signal that asked, as a shell expects of it; returns where none did.
void end_by_signal();

} // namespace palpate::command
