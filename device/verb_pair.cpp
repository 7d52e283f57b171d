// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"
#include "common/keys/pairing_code.h"
#include "device/uplink/pairing.h"
#include "device/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

namespace gyre {

namespace {

struct PairFlags {
  std::string keys;
  std::string host_key;
  std::string host;
  std::string code;
  std::string name = default_device_name();
};

Result<std::string> learn_host_key(const PairFlags& given, const std::string& public_key) {
  PairingRequest request;
  request.host = given.host;
  request.code = typed_pairing_code(given.code);
  request.device_name = given.name;
  request.public_key = public_key;
  if (const Result<void> valid = request.check(); !valid) return tl::unexpected(valid.error());
  return pair_with_host(request);
}

int pair(const PairFlags& given) {
  const std::filesystem::path folder = given.keys;
  const Result<KeyPair> keys = read_or_make_key_pair(device_key(folder));
  if (!keys) return report_error(keys.error());
  if (!given.host.empty()) {
    const Result<std::string> learned = learn_host_key(given, keys->public_key);
    if (!learned) return report_error(learned.error());
    const Result<void> written = write_public_key(host_key(folder), *learned);
    if (!written) return report_error(written.error());
  }
  if (!given.host_key.empty()) {
    if (!is_public_key(given.host_key)) {
      return report_error(wrong_use("not a public key", given.host_key, "`gyre-offload pair` prints it").value());
    }
    const Result<void> written = write_public_key(host_key(folder), given.host_key);
    if (!written) return report_error(written.error());
  }
  const Result<std::string> host = read_public_key(host_key(folder));
  const nlohmann::json line = {{"device_public_key", keys->public_key},
                               {"host_public_key", host ? nlohmann::json(*host) : nlohmann::json()}};
  std::printf("%s\n", line.dump().c_str());
  return 0;
}

}  // namespace

void add_pair_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<PairFlags>();
  flags->keys = (data_folder() / "keys").string();
  CLI::App* verb = app.add_subcommand(
      "pair", "let the host and this device know each other, by the code that `gyre-offload pair` shows; or by keys");
  CLI::Option* host = verb->add_option("HOST", flags->host, "where the host waits for it, tcp://ADDRESS:PORT");
  CLI::Option* code = verb->add_option("CODE", flags->code, "the one-time code");
  host->needs(code);
  verb->add_option("--name", flags->name, "what the host will call this device")->capture_default_str();
  verb->add_option("--keys", flags->keys, "folder of this device's keys")->capture_default_str();
  verb->add_option("--host-public-key", flags->host_key, "public key of the host, 40 characters, instead of a code")
      ->excludes(host);
  verb->callback([flags, &run] { run = [flags] { return pair(*flags); }; });
}

}  // namespace gyre
