// SPDX-License-Identifier: Apache-2.0
// A device plug-in in C++ whose open lets an exception out; with an option open does not,
// properties fail, and its reason lets one out.
#include <stdexcept>

#include <palpate/device_plugin.h>

namespace {

int32_t open(const palpate_plugin_options* options, void** device) {
    static int opened = 0;
    if (options->count == 0) throw std::runtime_error("no such port");
    *device = &opened;
    return PALPATE_PLUGIN_OK;
}
int32_t properties(void*, palpate_plugin_properties*) { return PALPATE_PLUGIN_FAILED; }
int32_t start(void*) { return PALPATE_PLUGIN_FAILED; }
int32_t read(void*, palpate_plugin_state*) { return PALPATE_PLUGIN_FAILED; }
int32_t write(void*, const double*) { return PALPATE_PLUGIN_FAILED; }
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
