// SPDX-License-Identifier: Apache-2.0
// The host's side of a pairing: waits for one device that knows the code. See common/wire/pairing.h.
#pragma once

#include "common/keys/keys.h"
#include "common/result/result.h"
#include "common/wire/wakeup.h"

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

namespace gyre {

struct PairingOptions {
  std::string endpoint = "tcp://*:7411";  // port 0 or *: any free one
  std::string public_key;                 // of this host
  std::filesystem::path allow_list;       // where the device is noted
  std::string code;                       // see common/keys/pairing_code.h
  std::chrono::milliseconds valid{300'000};
  int max_wrong = 5;

  Result<void> check() const;
};

class PairingHost {
 public:
  // Listens from now on; the code's time runs. options.check() must hold.
  static Result<std::unique_ptr<PairingHost>> open(PairingOptions options);
  ~PairingHost();
  PairingHost(const PairingHost&) = delete;
  PairingHost& operator=(const PairingHost&) = delete;

  std::string endpoint() const;  // with the real port

  // Answers until a device has paired, which is on the list then. Every wrong try is logged. Errors: the code's time is
  // over, it was tried wrongly too often, the list cannot be written, or `stop` was notified.
  Result<AuthorisedDevice> wait(const Wakeup& stop);

 private:
  class Desk;
  explicit PairingHost(std::unique_ptr<Desk> desk);
  std::unique_ptr<Desk> desk_;
};

}  // namespace gyre
