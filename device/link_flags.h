// SPDX-License-Identifier: Apache-2.0
// The flags of the verbs that talk to a host.
#pragma once

#include "common/result/result.h"
#include "device/uplink/uplink.h"
#include "device/verbs.h"

#include <string>

namespace gyre {

struct LinkFlags {
  std::string host;  // empty: none
  std::string keys = (data_folder() / "keys").string();
  std::string host_key;
  std::string name = default_device_name();
  double bandwidth_mbit = 0.0;
};

void add_link_flags(CLI::App& verb, LinkFlags& flags);

// Reads the keys. Errors: they cannot be read, no host was paired, an address that is none.
Result<UplinkOptions> uplink_options(const LinkFlags& given);

}  // namespace gyre
