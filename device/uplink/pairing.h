// SPDX-License-Identifier: Apache-2.0
// The device's side of a pairing. See common/wire/pairing.h.
#pragma once

#include "common/result/result.h"

#include <chrono>
#include <string>

namespace gyre {

struct PairingRequest {
  std::string host;         // where `gyre-offload pair` listens, "tcp://workstation:7411"
  std::string code;         // as typed_pairing_code returns it
  std::string device_name;  // what the host will call this device
  std::string public_key;   // of this device
  std::chrono::milliseconds patience{10'000};

  Result<void> check() const;
};

// Lets the host know this device and returns the host's public key, once the host has shown that it knows the code too.
// request.check() must hold. Errors: nobody answers, the code is wrong, the host refuses, or what answers does not know
// the code.
Result<std::string> pair_with_host(const PairingRequest& request);

}  // namespace gyre
