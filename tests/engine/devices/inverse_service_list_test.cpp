// SPDX-License-Identifier: Apache-2.0
#include <palpate/engine/devices/inverse_service_list.h>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <palpate/engine/devices/device_list.h>

#include "tests/support/simulated_inverse_service.h"

namespace palpate {
namespace {

using Answer = InverseService::Answer;

ListedInverseService with(std::vector<ListedInverse3> devices) {
    ListedInverseService listed;
    listed.found = {Answer::service, "", std::move(devices), {"61576"}};
    return listed;
}

ListedInverse3 arm() { return {"049D", "inverse3", "right", true, true, false}; }

TEST(InverseServiceList, ADeviceIsListedWithWhatScenesCallIt) {
    const ListedInverseService one = with({arm()});
    const char* line = "127.0.0.1:10001  Haply inverse3 049D (right): three-dimensional force  "
                       "inverse3:049D\n";
    EXPECT_EQ(inverse_service_text(one), line);
    EXPECT_EQ(inverse_service_why(one), line) << "nothing is in the way";
    EXPECT_EQ(device_list_text({}, DeviceListDetail::brief, {}, &one), line)
        << "not: no haptic device is attached";
    ListedInverseService far = one;
    far.address.host = "10.0.0.7";
    far.address.port = 8500;
    EXPECT_EQ(address_of(far, arm()), "inverse3:049D?host=10.0.0.7&port=8500");
    EXPECT_EQ(inverse3_address(address_of(far, arm()).substr(8)).port, 8500)
        << "what is listed is an address";
}

TEST(InverseServiceList, WhyTellsWhatIsInTheWayOfEach) {
    ListedInverse3 bad = arm();
    bad.is_calibrated = bad.has_power = false;
    bad.is_in_use = true;
    const ListedInverseService listed = with({bad});
    const std::string why = inverse_service_why(listed);
    for (const char* part : {"NOT USABLE", "in the way: it is not calibrated", "put the grip on",
                             "no power supply", "another program uses it"})
        EXPECT_NE(why.find(part), std::string::npos) << part << "\n" << why;
    EXPECT_EQ(usable_devices(listed), 0u);
    EXPECT_NE(device_list_text({}, DeviceListDetail::brief, {}, &listed)
                  .find("`palpate devices --why` says why"),
              std::string::npos);
}

TEST(InverseServiceList, NoServiceAServiceWithoutADeviceAndAStrangerAreToldApart) {
    const std::string empty = inverse_service_why(with({}));
    EXPECT_NE(empty.find("it has no device"), std::string::npos) << empty;
    ListedInverseService nobody;
    nobody.found.reason = "connecting: Connection refused";
    EXPECT_EQ(inverse_service_text(nobody), "") << "whoever has no such arm reads nothing of it";
    EXPECT_NE(inverse_service_why(nobody).find("it does not answer (connecting: Connection "
                                               "refused)\n    remedy: an Inverse3 is used"),
              std::string::npos)
        << inverse_service_why(nobody);
    EXPECT_TRUE(device_list_text({}, DeviceListDetail::brief, {}, &nobody)
                    .starts_with("no haptic device is attached"));
    // Whoever names a service wants to know.
    nobody.is_named = true;
    EXPECT_EQ(inverse_service_text(nobody), inverse_service_why(nobody));
    EXPECT_NE(device_list_text({}, DeviceListDetail::brief, {}, &nobody).find("does not answer"),
              std::string::npos);
    ListedInverseService stranger = nobody;
    stranger.found.answer = Answer::stranger;
    EXPECT_NE(inverse_service_why(stranger).find("another program"), std::string::npos);
}

TEST(InverseServiceList, JsonHasWhoAnsweredAndEachDevice) {
    ListedInverse3 bad = arm();
    bad.is_calibrated = false;
    const ListedInverseService listed = with({arm(), bad});
    const auto json =
        nlohmann::json::parse(device_list_json({}, {}, &listed)).at("inverse_service");
    EXPECT_EQ(json["address"], "127.0.0.1:10001");
    EXPECT_EQ(json["answer"], "service");
    EXPECT_EQ(json["grips"][0], "61576");
    EXPECT_EQ(json["devices"][0]["address"], "inverse3:049D");
    EXPECT_EQ(json["devices"][0]["handedness"], "right");
    EXPECT_TRUE(json["devices"][1]["address"].is_null());
    EXPECT_EQ(json["devices"][1]["usable"], false);
}

TEST(InverseServiceList, TheServiceThatIsNamedIsAsked) {
    test::SimulatedInverseService service;
    const std::string port = std::to_string(service.port());
    const ListedInverseService listed = listed_inverse_service("127.0.0.1:" + port);
    EXPECT_EQ(listed.found.answer, Answer::service) << listed.found.reason;
    EXPECT_EQ(address_of(listed, listed.found.devices.at(0)), "inverse3:049D?port=" + port);
    EXPECT_THROW(listed_inverse_service("127.0.0.1:0"), std::runtime_error);
    EXPECT_THROW(listed_inverse_service("127.0.0.1:"), std::runtime_error);
    EXPECT_THROW(listed_inverse_service(":1"), std::runtime_error);
    EXPECT_EQ(listed_inverse_service("::1").address.host, "::1") << "an address of IPv6, no port";
}

} // namespace
} // namespace palpate
