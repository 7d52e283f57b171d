// SPDX-License-Identifier: Apache-2.0
#include "device/link_flags.h"

#include "common/keys/keys.h"

#include <CLI/CLI.hpp>

namespace gyre {

void add_link_flags(CLI::App& verb, LinkFlags& flags) {
  verb.add_option("--host", flags.host, "the host, tcp://ADDRESS:PORT; default: none, scans stay here");
  verb.add_option("--keys", flags.keys, "folder of this device's keys, made when missing")->capture_default_str();
  verb.add_option("--host-key", flags.host_key, "file with the host's public key; default: host.pub among the keys");
  verb.add_option("--name", flags.name, "what this device calls itself")->capture_default_str();
  verb.add_option("--bandwidth-mbit", flags.bandwidth_mbit, "what sending may take of the line, Mbit/s; 0: all of it")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str();
}

Result<UplinkOptions> uplink_options(const LinkFlags& given) {
  UplinkOptions options;
  options.host = given.host;
  options.device_name = given.name;
  options.limit_bytes_per_s = given.bandwidth_mbit * 1e6 / 8.0;
  const Result<KeyPair> keys = read_or_make_key_pair(device_key(given.keys));
  if (!keys) return tl::unexpected(keys.error());
  options.keys = *keys;
  const std::filesystem::path file =
      given.host_key.empty() ? host_key(given.keys) : std::filesystem::path(given.host_key);
  const Result<std::string> host = read_public_key(file);
  if (!host) {
    Error error = host.error();
    error.remedy = "pair with the host first: gyre-device pair --host-public-key KEY";
    return tl::unexpected(error);
  }
  options.host_public_key = *host;
  if (const Result<void> valid = options.check(); !valid) return tl::unexpected(valid.error());
  return options;
}

}  // namespace gyre
