// SPDX-License-Identifier: Apache-2.0
// A fake of libnifalcon, for tests: the classes and functions that
// examples/device_plugins/falcon.cpp uses, written from the library's public documentation.
#pragma once

#include <cstdint>
#include <memory>

namespace libnifalcon {

class FalconFirmware {
public:
    bool loadFirmware(bool skip_checksum, const unsigned int& firmware_size, std::uint8_t* buffer);
    void setHomingMode(bool value);
    bool isHomed();
};

class FalconGrip {
public:
    unsigned int getDigitalInputs() const;
};

class FalconDevice {
public:
    bool open(std::uint8_t index);
    void close();
    bool isFirmwareLoaded();
    bool runIOLoop(std::uint8_t exe_flags = 7);
    double* getPosition() { return position_; }
    void setForce(double force[3]);
    int getErrorCode();
    std::shared_ptr<FalconFirmware> getFalconFirmware() { return firmware_; }
    std::shared_ptr<FalconGrip> getFalconGrip() { return grip_; }
    template <class T>
    void setFalconFirmware() {
        firmware_ = std::make_shared<T>();
    }
    template <class T>
    void setFalconGrip() {
        grip_ = std::make_shared<T>();
    }
    template <class T>
    void setFalconKinematic() {
        has_kinematic_ = true;
    }

private:
    std::shared_ptr<FalconFirmware> firmware_;
    std::shared_ptr<FalconGrip> grip_;
    bool has_kinematic_ = false;
    double position_[3] = {};
    double force_[3] = {};
};

} // namespace libnifalcon
