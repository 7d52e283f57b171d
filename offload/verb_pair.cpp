// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"
#include "offload/verbs.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

struct PairFlags {
  std::string store;
  std::string authorise;
  std::string name;
  std::string revoke;
};

int pair(const PairFlags& given) {
  const std::filesystem::path folder = given.store;
  const std::filesystem::path devices = folder / "devices";
  if (!given.authorise.empty()) {
    if (given.name.empty()) return report_error(wrong_use("a device needs a name", "", "add --name NAME").value());
    if (const auto done = authorise_device(devices, given.name, given.authorise); !done)
      return report_error(done.error());
  }
  if (!given.revoke.empty()) {
    if (const auto done = revoke_device(devices, given.revoke); !done) return report_error(done.error());
  }
  const Result<KeyPair> keys = read_or_make_key_pair(folder / "host.key");
  if (!keys) return report_error(keys.error());
  nlohmann::json list = nlohmann::json::array();
  for (const AuthorisedDevice& device : authorised_devices(devices))
    list.push_back({{"name", device.name}, {"public_key", device.public_key}});
  std::printf("%s\n", nlohmann::json{{"host_public_key", keys->public_key}, {"devices", list}}.dump().c_str());
  return 0;
}

}  // namespace

void add_pair_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<PairFlags>();
  CLI::App* verb = app.add_subcommand("pair", "let a device in or out; prints the host's public key and the devices");
  verb->add_option("--store", flags->store, "folder of the catalogue and the scans")->required();
  verb->add_option("--authorise", flags->authorise, "public key of a device to let in");
  verb->add_option("--name", flags->name, "name of that device");
  verb->add_option("--revoke", flags->revoke, "name of a device to shut out");
  verb->callback([flags, &run] { run = [flags] { return pair(*flags); }; });
}

}  // namespace gyre
