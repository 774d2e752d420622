// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>

#include <palpate/geometry/isosurface.h>

namespace palpate::internal {

/// What takes longer for one page: one thing at a time, in another thread. All that is public is
/// for the server's thread.
class PageWork : public std::enable_shared_from_this<PageWork> {
public:
    using Message = std::shared_ptr<const std::string>;
    using Work = std::function<Message(const Progress&)>;
    /// What was made, or null and what was wrong.
    using Done = std::function<void(const Message&, const std::string& why)>;

    /// `done` is called in the thread of `io`, until end().
    PageWork(boost::asio::io_context& io, boost::asio::thread_pool& worker, Done done)
        : io_(io), worker_(worker), done_(std::move(done)) {}

    bool is_busy() const noexcept { return cancel_ != nullptr; }

    /// Begins, or takes the place of what waits. What is under way is cancelled: its progress says
    /// so, and nobody is told of it.
    void begin(Work work) {
        waits_ = std::move(work);
        if (cancel_)
            *cancel_ = true;
        else
            start();
    }

    /// Nothing is told from here on.
    void end() {
        waits_ = {};
        done_ = {};
        if (cancel_) *cancel_ = true;
    }

private:
    void start() {
        cancel_ = std::make_shared<std::atomic<bool>>(false);
        boost::asio::post(worker_, [self = shared_from_this(), cancel = cancel_,
                                    work = std::exchange(waits_, {})] {
            Message made;
            std::string why;
            try {
                if (!*cancel) made = work([cancel](double, std::string_view) { return !*cancel; });
            } catch (const std::exception& error) {
                why = error.what();
            }
            boost::asio::post(self->io_, [self, made = std::move(made), why = std::move(why)] {
                self->has_ended(made, why);
            });
        });
    }

    void has_ended(const Message& made, const std::string& why) {
        const bool is_newest = !*cancel_;
        cancel_.reset();
        if (waits_) start();
        if (is_newest && done_) done_(made, why);
    }

    boost::asio::io_context& io_;
    boost::asio::thread_pool& worker_;
    Done done_;
    Work waits_;                                // for what is under way to end
    std::shared_ptr<std::atomic<bool>> cancel_; // of what is under way; null: nothing is
};

} // namespace palpate::internal
