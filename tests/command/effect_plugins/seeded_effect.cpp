// SPDX-License-Identifier: Apache-2.0
// An effect in a library without a fault: a ball of 40 mm around the origin whose inside draws the
// proxy to its middle, through a medium, the more the further the proxy has gone. With a name in
// the environment variable PALPATE_DEFECT it has one fault. What is wrong before it is made is
// chosen when this is compiled: NO_ENTRY, WRONG_VERSION, WRONG_LAYOUT.
#include <any>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <limits>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <stdexcept>
#include <string_view>
#include <thread>

#include <sys/syscall.h>
#include <unistd.h>

#include <palpate/engine/loop/effect_library.h>

namespace {

using palpate::FrameContext;
using palpate::FrameOutcome;
using palpate::PrimitiveSet;
using palpate::Vec3;

const char* const chosen = std::getenv("PALPATE_DEFECT");
bool has(std::string_view defect) { return chosen != nullptr && chosen == defect; }

constexpr double kRadius_m = 0.04, kStrength_n = 0.3, kPush_n = 1.0;

int frames_of_all = 0; // what no effect should have
std::mutex mutex;
std::shared_mutex shared;
void* volatile kept = nullptr;

/// As large as the C library maps it alone.
void leak_large() {
    constexpr std::size_t kLarge = 1 << 20;
    void* const large = std::malloc(kLarge);
    if (large != nullptr) std::memset(large, 1, kLarge);
    kept = large;
}

void die_in_another_process() {
    static const pid_t first = ::getpid();
    if (::getpid() != first) std::abort();
}

class Seeded final : public palpate::Effect {
public:
    Seeded() {
        if (has("LEAKS_MEMORY")) kept = std::malloc(5000);
        if (has("LEAKS_LARGE")) leak_large();
        if (has("DIES_IN_ANOTHER_PROCESS")) die_in_another_process();
        if (has("LEAKS_THREAD"))
            std::thread([] { std::this_thread::sleep_for(std::chrono::hours(1)); }).detach();
    }

    void restart(const Vec3& proxy) noexcept override {
        if (has("RESTARTS_CRASH") && ++restarts_ > 2) std::abort();
        has_begun_ = false;
        if (has("NO_RESTART")) return;
        now_ = {.touched = now_.touched}; // which REMEMBERS_TOUCH alone sets
        now_.last = proxy;
    }

    void begin(const FrameContext& frame) noexcept override {
        if (has("CRASHES_ON_LEAP") && glm::distance(frame.probe, now_.last_probe) > 0.5 &&
            now_.frames > 0)
            std::abort();
        if (has("CRASHES_AFTER_SILENCE") && frame.after_silence) std::abort();
        if (has("PERIOD")) push_n_ = std::sqrt(frame.period_s - 1e-4);
        if (has("SLOW")) burn();
        if (has("TIME_OF_KERNEL")) { // as every clock is where the counter is not trusted
            timespec now{};
            ::syscall(SYS_clock_gettime, CLOCK_MONOTONIC, &now);
        }
        if (has("ALLOCATES")) {
            kept = std::malloc(100);
            std::free(kept);
        }
        if (has("LOCKS")) const std::lock_guard lock(mutex);
        if (has("LOCKS_SHARED")) const std::shared_lock lock(shared);
        if (has("SLEEPS")) std::this_thread::sleep_for(std::chrono::microseconds(1));
        if (has("CLOCK"))
            push_n_ =
                1e-6 * static_cast<double>(
                           std::chrono::steady_clock::now().time_since_epoch().count() % 1000);
        if (has("STATIC")) push_n_ = 1e-3 * (++frames_of_all % 100);
        if (has("DRIVES"))
            drive_ = 0.15 * (frame.probe - now_.last_probe) /
                     (glm::distance(frame.probe, now_.last_probe) + 1e-6);
        if (has("SAYS_AS_IT_PUSHES")) said_n_ = kPush_n;
        now_.last_probe = frame.probe;
        start_ = frame.start;
        ++now_.frames;
        gathered_ = 0;
        has_begun_ = true;
    }

    void gather(const Vec3& proxy, PrimitiveSet& primitives) noexcept override {
        const double depth_m = kRadius_m - glm::length(proxy);
        ++gathered_;
        if (has("GATHER_MOVES")) now_.way_m += 1e-4;
        if (has("FAR")) primitives.add_force(Vec3(std::exp(glm::length(proxy)) * 1e-300));
        if (has("PUSHES") || has("SAYS_AS_IT_PUSHES")) primitives.add_force({0.0, 0.0, kPush_n});
        if (has("BENDS"))
            primitives.add({proxy + Vec3(gathered_ % 2 == 0 ? 1e-3 : -1e-3, 0.0, 0.0),
                            {gathered_ % 2 == 0 ? 1.0 : -1.0, 0.0, 0.0},
                            0.5});
        felt_at_ = depth_m > 0.0 ? proxy : Vec3(std::numeric_limits<double>::quiet_NaN());
        if (!(depth_m > 0.0) || has("NOT_FELT")) return;
        double strength_n = kStrength_n * (1.0 + 0.1 * now_.way_m) + (now_.touched ? 0.1 : 0.0);
        if (has("NAN") && now_.frames % 50 == 0)
            strength_n = std::numeric_limits<double>::quiet_NaN();
        if (has("NEGATIVE") && now_.frames % 50 == 0) strength_n = -1.0;
        if (has("LONG_AXIS")) primitives.add_line({Vec3(0.0), Vec3(0.0, 0.0, 1.1), 0.0});
        primitives.add_point({Vec3(0.0), strength_n});
        for (int i = 0; i < 3 && has("MANY"); ++i)
            primitives.add_point({Vec3(0.0), 0.01});
        primitives.add_spring(start_, 20.0);
    }

    void commit(const FrameOutcome& end) noexcept override {
        now_.way_m += glm::distance(end.proxy, now_.last);
        now_.last = end.proxy;
        // As method `single` ends frames: it was not asked where the proxy came to.
        if (has("ASKED_ONCE") && gathered_ == 1 && glm::distance(end.proxy, felt_at_) > 1e-6)
            std::abort();
        if (has("REMEMBERS_TOUCH") && end.felt != 0) now_.touched = true;
    }

    Vec3 device_force_n() const noexcept override {
        if (has("SHAKES")) return {0.0, 0.0, now_.frames % 2 == 0 ? 0.05 : -0.05};
        if (has("DRIVES")) return drive_;
        return {0.0, 0.0, push_n_};
    }
    double unasked_force_n() const noexcept override {
        return has("SAYS_NEGATIVE") ? -1.0 : said_n_;
    }
    std::size_t most_primitives() const noexcept override { return has("LONG_AXIS") ? 2 : 1; }
    palpate::QueryCount queries() const noexcept override {
        if (has("COUNTS_IN_BEGIN") && !has_begun_) std::abort();
        return {};
    }

    std::any save_state() const override {
        if (has("FORGETS")) return {};
        return has("OWN_STATE") ? std::any(std::pair(this, now_)) : std::any(now_);
    }
    void restore_state(const std::any& state) override {
        if (has("FORGETS")) return;
        if (!has("OWN_STATE")) {
            now_ = std::any_cast<const State&>(state);
            return;
        }
        const auto& [of, what] = std::any_cast<const std::pair<const Seeded*, State>&>(state);
        if (of != this) throw std::runtime_error("not mine");
        now_ = what;
    }

private:
    struct State {
        int frames = 0;
        double way_m = 0.0;
        Vec3 last{0.0};
        Vec3 last_probe{0.0};
        bool touched = false;
    };

    static void burn() noexcept {
        volatile double sum = 0.0;
        for (int i = 0; i < 800000; ++i)
            sum = sum + std::sqrt(static_cast<double>(i));
    }

    State now_;
    Vec3 start_{0.0}, drive_{0.0};
    Vec3 felt_at_{0.0}; // where it was asked last; no number: there it adds nothing
    double push_n_ = 0.0;
    double said_n_ = 0.0; // of the frame that has begun; before the first, nothing is pushed
    int gathered_ = 0, restarts_ = 0;
    bool has_begun_ = true; // since the last restart()
};

std::unique_ptr<palpate::Effect> make(const palpate::Scene&) {
    if (has("THROWS")) throw std::runtime_error("no such table; give one");
    if (has("NULL")) return nullptr;
    return std::make_unique<Seeded>();
}

} // namespace

#ifdef NO_ENTRY
#define palpate_effect_library some_other_function
#endif
#if defined(WRONG_VERSION) || defined(WRONG_LAYOUT)
extern "C" __attribute__((visibility("default"))) const palpate::EffectLibrary*
palpate_effect_library() {
    static const palpate::EffectLibrary library = [] {
        palpate::EffectLibrary said = palpate::effect_library("seeded", make);
#ifdef WRONG_VERSION
        said.palpate = "0.0.1";
#else
        said.frame_size += 8;
#endif
        return said;
    }();
    return &library;
}
#else
PALPATE_EFFECT_LIBRARY("seeded", make)
#endif
