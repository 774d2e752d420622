// SPDX-License-Identifier: Apache-2.0
// A device plug-in in C++ whose open lets an exception out. With the option only = properties open
// does not, properties fail, and its reason lets one out. With only = frames read and write do.
#include <cstring>
#include <stdexcept>

#include <palpate/device_plugin.h>

namespace {

bool throws_in_frames = false;

int32_t open(const palpate_plugin_options* options, void** device) {
    static int opened = 0;
    if (options->count == 0) throw std::runtime_error("no such port");
    throws_in_frames = std::strcmp(options->values[0], "frames") == 0;
    *device = &opened;
    return PALPATE_PLUGIN_OK;
}
int32_t properties(void*, palpate_plugin_properties* said) {
    if (!throws_in_frames) return PALPATE_PLUGIN_FAILED;
    std::strcpy(said->name, "throwing");
    said->rate_hz = 1000.0;
    said->longest_call_s = 0.1;
    said->stale_after_s = 0.1;
    return PALPATE_PLUGIN_OK;
}
int32_t start(void*) { return throws_in_frames ? PALPATE_PLUGIN_OK : PALPATE_PLUGIN_FAILED; }
int32_t read(void*, palpate_plugin_state*) { throw std::runtime_error("no state"); }
int32_t write(void*, const double*) { throw std::runtime_error("no force"); }
int32_t stop(void*) { return PALPATE_PLUGIN_OK; }
void close(void*) {}
const char* reason(void*) { throw std::runtime_error("no words"); }

} // namespace

const palpate_device_plugin* palpate_device_plugin_entry() {
    static const palpate_device_plugin functions{sizeof functions,
                                                 PALPATE_DEVICE_PLUGIN_ABI,
                                                 0,
                                                 "throwing",
                                                 "1.0",
                                                 open,
                                                 properties,
                                                 start,
                                                 read,
                                                 write,
                                                 stop,
                                                 close,
                                                 reason};
    return &functions;
}
