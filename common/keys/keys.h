// SPDX-License-Identifier: Apache-2.0
// CURVE key pairs of device and host, and the host's list of the devices it lets in.
#pragma once

#include "common/result/result.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace gyre {

// A private key that cannot be printed by accident: it has to be asked for by name, and is wiped when it goes.
class SecretKey {
 public:
  SecretKey() = default;
  explicit SecretKey(std::string z85) : z85_(std::move(z85)) {}
  SecretKey(const SecretKey&) = default;
  SecretKey& operator=(const SecretKey&) = default;
  ~SecretKey();

  const std::string& reveal() const { return z85_; }

 private:
  std::string z85_;
};

// A CURVE key pair; both keys are 40 characters of Z85 (rfc.zeromq.org/spec/32).
struct KeyPair {
  std::string public_key;
  SecretKey secret_key;
};

// True for 40 characters of Z85 that decode to a 32 byte key.
bool is_public_key(std::string_view text);

KeyPair make_key_pair();

// Writes the secret key to `file` (mode 0600) and the public key next to it, as `file`.pub. Never overwrites a key.
Result<void> write_key_pair(const std::filesystem::path& file, const KeyPair& keys);

// Reads the secret key in `file` and derives the public one. A file others may read is refused, unless it lies in the
// folder of systemd's credentials.
Result<KeyPair> read_key_pair(const std::filesystem::path& file);

// Reads the pair, or makes and writes one when there is none yet.
Result<KeyPair> read_or_make_key_pair(const std::filesystem::path& file);

// A file that holds one public key, as write_key_pair and authorise_device write it.
Result<void> write_public_key(const std::filesystem::path& file, const std::string& public_key);
Result<std::string> read_public_key(const std::filesystem::path& file);

// The host's allow-list is a folder with one <name>.pub for every device that may connect.
struct AuthorisedDevice {
  std::string name;
  std::string public_key;
};

// True for what a device may be called on the list: letters, digits, '-', '_' and '.', at most 64.
bool is_device_name(std::string_view name);

// Lets a device in from now on; an existing name gets the new key.
Result<void> authorise_device(const std::filesystem::path& allow_list, const std::string& name,
                              const std::string& public_key);

// Takes a device off the list; an unknown name is an error.
Result<void> revoke_device(const std::filesystem::path& allow_list, const std::string& name);

// All devices on the list by name; files that do not hold a public key are skipped. A missing folder is an empty list.
std::vector<AuthorisedDevice> authorised_devices(const std::filesystem::path& allow_list);

// Name of the device with that key, or nothing when it may not connect.
std::optional<std::string> authorised_name(const std::filesystem::path& allow_list, std::string_view public_key);

// The list for those who ask at every message: read again only when it has changed. For one thread.
class AllowList {
 public:
  explicit AllowList(std::filesystem::path folder) : folder_(std::move(folder)) {}
  bool contains(const std::string& public_key);

 private:
  std::filesystem::path folder_;
  std::set<std::string> keys_;
  std::int64_t changed_ns_ = 0;  // when the folder changed that keys_ shows; 0: it may have changed since
};

}  // namespace gyre
