// SPDX-License-Identifier: Apache-2.0
// The driver over a simulated service on loopback: as documented, and as nobody wants it.
#include <palpate/drivers/inverse3_device.h>

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/device_calls.h"
#include "tests/support/patience.h"
#include "tests/support/simulated_inverse_service.h"

namespace palpate {
namespace {

using test::HeardCommand;
using test::ServiceFrame;
using test::settings_of;
using Service = test::SimulatedInverseService;
using Version = Service::Version;

constexpr Vec3 kPush(2.0, 0.0, 0.0); // towards the user; backward, -y, for the service

/// A started device, and a loop that always wants the same force.
struct Rig {
    explicit Rig(Service& with, const std::string& more = "")
        : Rig(with, settings_of(with, more)) {}
    Rig(Service& with, const Inverse3Device::Settings& settings) : service(with), device(settings) {
        device.open();
        device.start();
    }
    bool fresh() {
        EXPECT_TRUE(device.read(state));
        EXPECT_TRUE(is_finite(state.position));
        return state.freshness == Freshness::fresh;
    }
    /// Wants this force until the condition holds.
    template <class Condition>
    bool pushes_until(Condition condition, const Vec3& force = kPush) {
        return test::comes_true([&] {
            device.write(force);
            fresh();
            return condition();
        });
    }
    bool is_pushed() {
        return pushes_until([&] {
            const auto heard = service.heard();
            return std::any_of(heard.begin(), heard.end(), [](const HeardCommand& command) {
                return command.force == Vec3(0.0, -2.0, 0.0);
            });
        });
    }
    Service& service;
    Inverse3Device device;
    DeviceState state;
};

bool is_zero(const HeardCommand& command) { return command.force == Vec3(0.0); }

#define EXPECT_PART(text, part)                                                                    \
    EXPECT_NE(std::string(text).find(part), std::string::npos) << std::string(text)

class Inverse3Versions : public testing::TestWithParam<Version> {};

TEST_P(Inverse3Versions, StatesComeInTheDeviceFrameAndForcesGoInTheServices) {
    Service service(GetParam());
    service.move_to({0.10, -0.12, 0.15});
    Rig rig(service);
    ASSERT_TRUE(test::comes_true([&] { return rig.fresh(); }));
    EXPECT_EQ(rig.state.position, Vec3(0.12, 0.10, 0.15));
    EXPECT_EQ(rig.state.velocity, Vec3(-0.02, 0.01, 0.03));
    EXPECT_EQ(rig.state.buttons, 0b10u);
    EXPECT_NEAR(rig.state.orientation.y, 0.8, 1e-12) << "its x is our y";
    const double first_s = rig.state.time_s;
    EXPECT_TRUE(test::comes_true([&] { return rig.fresh() && rig.state.time_s > first_s; }));
    EXPECT_TRUE(rig.is_pushed());
    rig.device.write(kPush);
    for (const HeardCommand& command : service.heard()) {
        EXPECT_EQ(command.device_id, "049D");
        EXPECT_EQ(command.key, GetParam() == Version::v3_5 ? "vector" : "values");
    }
    EXPECT_EQ(rig.state.trial, rig.device.counts().losses);
    EXPECT_EQ(rig.device.counts().unreadable + rig.device.counts().unasked, 0u);
}

INSTANTIATE_TEST_SUITE_P(Documented, Inverse3Versions,
                         testing::Values(Version::v3_1, Version::v3_5),
                         [](const testing::TestParamInfo<Version>& version) {
                             return version.param == Version::v3_1 ? "V31" : "V35";
                         });

TEST(Inverse3Device, A35ServiceIsToldOnceThatItsOwnFrameIsWanted) {
    Service service;
    Rig rig(service);
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().states > 5; }));
    const std::vector<HeardCommand> heard = service.heard();
    ASSERT_GT(heard.size(), 3u);
    EXPECT_TRUE(heard[0].has_session);
    EXPECT_EQ(std::count_if(heard.begin(), heard.end(),
                            [](const HeardCommand& command) { return command.has_session; }),
              static_cast<std::ptrdiff_t>(rig.device.counts().connections));
}

TEST(Inverse3Device, ADeviceIsChosenByItsIdAndOthersGetNoForce) {
    Service service(Version::v3_5, {"049D", "04EA"});
    auto settings = settings_of(service);
    settings.address.device_id = "04EA";
    Rig rig(service, settings);
    EXPECT_TRUE(rig.is_pushed());
    EXPECT_EQ(rig.device.properties().name, "Haply inverse3 04EA (right)");
    rig.device.stop();
    for (const HeardCommand& command : service.heard())
        EXPECT_EQ(command.device_id, "04EA");
}

TEST(Inverse3Device, TwoHandsShareAService) {
    Service service(Version::v3_5, {"049D", "04EA"});
    auto second = settings_of(service);
    second.address.device_id = "04EA";
    Rig left(service), right(service, second);
    EXPECT_TRUE(test::comes_true([&] { return left.fresh() && right.fresh(); }));
    EXPECT_GE(service.connections(), 2);
}

TEST(Inverse3Device, AForceIsFiniteAndNoLongerThanItsLimit) {
    Service service;
    Rig rig(service, "&force_n=4");
    EXPECT_EQ(rig.device.properties().force_n, 4.0);
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double inf = std::numeric_limits<double>::infinity();
    for (const Vec3& force : {Vec3(100.0, 0.0, 0.0), Vec3(nan, 1.0, 0.0), Vec3(1.0, inf, 0.0),
                              Vec3(1e308, 1e308, 1e308), Vec3(3.0, 3.0, 3.0)}) {
        const std::uint64_t before = rig.device.counts().states;
        ASSERT_TRUE(
            rig.pushes_until([&] { return rig.device.counts().states > before + 5; }, force));
    }
    bool was_at_limit = false;
    for (const HeardCommand& command : service.heard()) {
        EXPECT_TRUE(is_finite(command.force));
        EXPECT_LE(glm::length(command.force), 4.0 * (1.0 + 1e-12)) << "three roundings";
        was_at_limit = was_at_limit || glm::length(command.force) > 3.999;
    }
    EXPECT_TRUE(was_at_limit);
}

TEST(Inverse3Device, AForceThatTheLoopDoesNotRenewEnds) {
    Service service;
    Rig rig(service);
    ASSERT_TRUE(rig.is_pushed());
    EXPECT_TRUE(test::comes_true([&] {
        const auto heard = service.heard();
        return !heard.empty() && is_zero(heard.back());
    }));
    EXPECT_TRUE(rig.fresh()) << "the states go on";
}

TEST(Inverse3Device, TheLastThingThatAServiceHearsIsAZeroForce) {
    Service service;
    // The service hears it by and by: the device waits for its answer for 50 ms, and no longer.
    const auto ends_with_zero = [&] {
        bool is_so = false;
        return test::comes_true([&] {
            if (const auto heard = service.heard(); !heard.empty()) is_so = is_zero(heard.back());
            return is_so;
        });
    };
    {
        Rig rig(service);
        ASSERT_TRUE(rig.is_pushed());
        rig.device.write(kPush);
        rig.device.stop();
        EXPECT_TRUE(ends_with_zero()) << "after stop()";
        rig.device.start();
        ASSERT_TRUE(rig.is_pushed()) << "it starts again";
        rig.device.close();
        EXPECT_TRUE(ends_with_zero()) << "after close()";
        rig.device.stop(); // more than once does no harm
        rig.device.open();
        rig.device.start();
        ASSERT_TRUE(rig.is_pushed()) << "it opens again";
    }
    EXPECT_TRUE(ends_with_zero()) << "after destruction";
}

TEST(Inverse3Device, ReadingAndWritingIsNoSystemCall) {
#ifdef PALPATE_HAS_SYSTEM_CALL_FILTER
    Service service;
    Rig rig(service);
    test::expect_no_system_calls(rig.device);
#else
    GTEST_SKIP() << "no such filter here";
#endif
}

/// A fault of the service: how it answers, and which count tells of it.
struct Fault {
    const char* name;
    std::uint64_t Inverse3Device::Counts::*count;
    Service::Behaviour (*behaviour)(const Service& service);
};

std::vector<ServiceFrame> one(const std::string& text) { return {{text, false, {}}}; }

std::string in_state(const std::string& position) {
    return R"({"inverse3":[{"device_id":"049D","state":{"cursor_position":)" + position + "}}]}";
}

using Counts = Inverse3Device::Counts;

const std::array kFaults{
    Fault{"SaysNothing", &Counts::silences,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) { return std::vector<ServiceFrame>(); };
          }},
    Fault{"NoJson", &Counts::unreadable,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) { return one("{\"inverse3\":[{"); };
          }},
    Fault{"Binary", &Counts::unreadable,
          [](const Service& service) -> Service::Behaviour {
              return [&service](const HeardCommand&) {
                  return std::vector<ServiceFrame>{{service.state_message(), true, {}}};
              };
          }},
    Fault{"NotANumber", &Counts::unreadable,
          [](const Service&) -> Service::Behaviour {
              return
                  [](const HeardCommand&) { return one(in_state("{\"x\":NaN,\"y\":0,\"z\":0}")); };
          }},
    Fault{"FarAway", &Counts::out_of_range,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) { return one(in_state("{\"x\":0,\"y\":9,\"z\":0}")); };
          }},
    Fault{"OtherIds", &Counts::not_there,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) {
                  std::string state = in_state("{\"x\":0,\"y\":0,\"z\":0}");
                  return one(state.replace(state.find("049D"), 4, "FFFF"));
              };
          }},
    Fault{"NotCalibrated", &Counts::uncalibrated,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) {
                  std::string state = in_state("{\"x\":0,\"y\":0,\"z\":0}");
                  return one(
                      state.insert(state.find("\"state\""), R"("status":{"calibrated":false},)"));
              };
          }},
    Fault{"Late", &Counts::late,
          [](const Service& service) -> Service::Behaviour {
              return [&service](const HeardCommand&) {
                  return std::vector<ServiceFrame>{
                      {service.state_message(), false, std::chrono::milliseconds(60)}};
              };
          }},
    Fault{"TooLong", &Counts::losses,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) { return one(std::string(300'000, ' ')); };
          }},
    Fault{"NotUnicode", &Counts::losses,
          [](const Service&) -> Service::Behaviour {
              return [](const HeardCommand&) { return one("\xff\xfe\xff"); };
          }},
    Fault{"Floods", &Counts::losses,
          [](const Service& service) -> Service::Behaviour {
              return [&service](const HeardCommand&) {
                  return std::vector<ServiceFrame>(300, {service.state_message(), false, {}});
              };
          }},
};

class Inverse3Faults : public testing::TestWithParam<Fault> {};

/// Whatever the service does: the states become stale, from then on no force is sent, and when it
/// behaves again they are fresh and the force is back.
TEST_P(Inverse3Faults, EndTheForceAndAreOverWhenTheServiceIsWellAgain) {
    Service service;
    auto settings = settings_of(service);
    settings.stale_after_s = 0.03;
    settings.lost_after_s = 0.3;
    Rig rig(service, settings);
    ASSERT_TRUE(rig.is_pushed());
    const std::uint64_t before = rig.device.counts().*GetParam().count;
    service.behave(GetParam().behaviour(service));
    ASSERT_TRUE(rig.pushes_until([&] { return rig.device.counts().*GetParam().count > before; }));
    ASSERT_TRUE(rig.pushes_until([&] { return rig.state.freshness == Freshness::stale; }));
    service.heard();
    const std::uint64_t states = rig.device.counts().states;
    for (int i = 0; i < 100; ++i) {
        rig.device.write(kPush);
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    // One that floods is fresh for a moment whenever it is found again.
    auto heard = service.heard();
    if (rig.device.counts().states == states) {
        // One may have been on its way when the state became stale; no two ever are.
        if (!heard.empty()) heard.erase(heard.begin());
        EXPECT_TRUE(std::all_of(heard.begin(), heard.end(), is_zero)) << "a force without a state";
    }
    service.behave(nullptr);
    EXPECT_TRUE(rig.pushes_until([&] { return rig.state.freshness == Freshness::fresh; }));
    EXPECT_TRUE(rig.is_pushed());
    EXPECT_PART(rig.device.complaint(), "the first: ");
    const Counts counts = rig.device.counts();
    EXPECT_EQ(rig.state.trial, counts.losses) << "each time it was lost a new trial begins";
}

INSTANTIATE_TEST_SUITE_P(Service, Inverse3Faults, testing::ValuesIn(kFaults),
                         [](const testing::TestParamInfo<Fault>& fault) {
                             return fault.param.name;
                         });

TEST(Inverse3Device, WhatCameWithoutBeingAskedForIsNoState) {
    Service service;
    Rig rig(service);
    ASSERT_TRUE(rig.is_pushed());
    const std::string here = service.state_message();
    service.move_to({0.2, 0.0, 0.0});
    // Each answer is followed by a state that was old before it was sent.
    service.behave([&service, here](const HeardCommand&) { // which outlives what is here
        return std::vector<ServiceFrame>{{service.state_message(), false, {}},
                                         {here, false, std::chrono::milliseconds(15)}};
    });
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().unasked > 0; }));
    const std::uint64_t before = rig.device.counts().states;
    ASSERT_TRUE(test::comes_true([&] { return rig.device.counts().states > before + 3; }));
    for (int i = 0; i < 50; ++i) {
        rig.fresh();
        EXPECT_EQ(rig.state.position, Vec3(0.0, 0.2, 0.0));
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_EQ(rig.device.counts().losses, 0u) << "some of them are no flood";
}

TEST(Inverse3Device, AServiceThatDoesNotSayWhatItHasReadGetsNoForce) {
    Service service;
    auto settings = settings_of(service);
    settings.stale_after_s = 0.03;
    settings.lost_after_s = 0.3;
    Rig rig(service, settings);
    ASSERT_TRUE(rig.is_pushed());
    service.answer_no_pings();
    service.hang_up();
    ASSERT_TRUE(rig.pushes_until([&] { return rig.device.counts().losses >= 3; }))
        << "hung up once, then left";
    EXPECT_GT(rig.device.counts().late, 0u);
}

TEST(Inverse3Device, AServiceThatIsStartedAnewIsFoundAndANewTrialBegins) {
    Service service;
    Rig rig(service);
    ASSERT_TRUE(rig.is_pushed());
    service.hang_up();
    ASSERT_TRUE(test::comes_true([&] { return rig.fresh() && rig.state.trial >= 1; }));
    ASSERT_TRUE(rig.is_pushed());
    service.stop();
    ASSERT_TRUE(test::comes_true([&] { return !rig.fresh(); }));
    const auto began = std::chrono::steady_clock::now();
    std::this_thread::sleep_for(std::chrono::milliseconds(120));
    service.restart();
    ASSERT_TRUE(test::comes_true([&] { return rig.fresh(); }));
    EXPECT_GE(rig.state.trial, 2u);
    EXPECT_GE(std::chrono::steady_clock::now() - began, std::chrono::milliseconds(120));
    EXPECT_TRUE(rig.is_pushed());
    EXPECT_GE(rig.device.counts().connections, 3u);
}

TEST(Inverse3Device, AForceOfBeforeIsNotSentToAServiceThatIsFoundAgain) {
    Service service;
    auto settings = settings_of(service);
    settings.force_hold_s = 3600.0; // however long forces are held
    Rig rig(service, settings);
    ASSERT_TRUE(rig.is_pushed());
    service.hang_up();
    ASSERT_TRUE(test::comes_true([&] { return rig.fresh() && rig.state.trial >= 1; }));
    service.heard(); // of before
    std::vector<HeardCommand> heard;
    ASSERT_TRUE(test::comes_true([&] {
        for (HeardCommand& command : service.heard())
            heard.push_back(std::move(command));
        return heard.size() >= 5;
    }));
    EXPECT_TRUE(std::all_of(heard.begin(), heard.end(), is_zero));
}

TEST(Inverse3Device, StoppingDoesNotWaitForAServiceThatIsGone) {
    Service service;
    auto settings = settings_of(service);
    settings.reconnect_s = 3600.0;
    auto rig = std::make_unique<Rig>(service, settings);
    ASSERT_TRUE(rig->is_pushed());
    service.stop();
    ASSERT_TRUE(test::comes_true([&] { return rig->device.counts().losses == 1; }));
    const auto began = std::chrono::steady_clock::now();
    rig.reset();
    EXPECT_LT(std::chrono::steady_clock::now() - began, std::chrono::seconds(20))
        << "it would have looked for it again in an hour";
}

TEST(Inverse3Device, AServiceThatAppliesNoForceIsComplainedOf) {
    Service service;
    auto settings = settings_of(service);
    settings.rate_hz = 100.0; // so that half a second is 50 states
    Rig rig(service, settings);
    service.behave([&](const HeardCommand&) {
        std::string said = service.state_message();
        const std::size_t at = said.find("\"current_cursor_force\":{");
        const std::size_t end = said.find('}', at);
        return one(said.replace(at, end - at, R"("current_cursor_force":{"x":0,"y":0,"z":0)"));
    });
    EXPECT_TRUE(rig.pushes_until(
        [&] { return rig.device.complaint().find("applies no force") != std::string::npos; }));
    service.behave(nullptr);
    EXPECT_TRUE(rig.pushes_until(
        [&] { return rig.device.complaint().find("applies no force") == std::string::npos; }));
}

TEST(Inverse3Device, SettingsThatCannotBeAreRefused) {
    const auto refused = [](auto change) {
        Inverse3Device::Settings settings;
        change(settings);
        EXPECT_THROW(Inverse3Device{settings}, std::invalid_argument);
    };
    const double nan = std::numeric_limits<double>::quiet_NaN();
    refused([&](auto& s) { s.rate_hz = nan; });
    refused([&](auto& s) { s.rate_hz = 5000.0; });
    refused([&](auto& s) { s.stale_after_s = nan; });
    refused([&](auto& s) { s.force_hold_s = 0.0; });
    refused([&](auto& s) { s.lost_after_s = 0.01; });
    refused([&](auto& s) { s.reconnect_s = -1.0; });
    refused([&](auto& s) { s.patience_s = 0.0; });
    refused([&](auto& s) { s.patience_s = 1e10; }); // more than a clock's nanoseconds can count
    refused([&](auto& s) { s.address.force_n = nan; });
    refused([&](auto& s) { s.address.force_n = 11.0; });
}

} // namespace
} // namespace palpate
