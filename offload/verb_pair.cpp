// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"
#include "common/keys/pairing_code.h"
#include "common/qr/qr_text.h"
#include "offload/ingest/pairing.h"
#include "offload/verbs.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <unistd.h>
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

namespace gyre {

namespace {

struct PairFlags {
  std::string store;
  std::string key;
  std::string devices;
  std::string endpoint = "tcp://*:7411";
  bool list = false;
  std::string authorise;
  std::string name;
  std::string revoke;
};

// This machine's first address that other machines could use, or that of the loopback.
std::string own_address() {
  std::string address = "127.0.0.1";
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) return address;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    const bool usable = one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET &&
                        (one->ifa_flags & IFF_UP) != 0 && (one->ifa_flags & IFF_LOOPBACK) == 0;
    if (!usable) continue;
    char text[INET_ADDRSTRLEN] = {};
    ::inet_ntop(AF_INET, &reinterpret_cast<const sockaddr_in*>(one->ifa_addr)->sin_addr, text, sizeof text);
    address = text;
    break;
  }
  ::freeifaddrs(all);
  return address;
}

// Where a device finds a socket that listens on `endpoint`.
std::string reachable(const std::string& endpoint) {
  constexpr std::string_view any = "tcp://0.0.0.0:";
  if (!endpoint.starts_with(any)) return endpoint;
  return "tcp://" + own_address() + ":" + endpoint.substr(any.size());
}

void show(const std::string& endpoint, const std::string& code, std::chrono::seconds valid) {
  const std::string spaced = spaced_pairing_code(code);
  const nlohmann::json line = {{"endpoint", endpoint}, {"code", spaced}, {"valid_s", valid.count()}};
  std::printf("%s\n", line.dump().c_str());
  std::fflush(stdout);
  if (isatty(STDERR_FILENO) == 0) return;
  const std::string words = endpoint + " " + spaced;
  std::fprintf(stderr, "%s\nOn the device, within %lld minutes:\n\n  gyre-device pair %s\n\n",
               qr_text(qr_modules(words)).c_str(), static_cast<long long>(valid.count() / 60), words.c_str());
}

int pair_by_code(const PairFlags& given, const std::string& public_key, const std::filesystem::path& devices) {
  PairingOptions options;
  options.endpoint = given.endpoint;
  options.public_key = public_key;
  options.allow_list = devices;
  options.code = new_pairing_code();
  if (const Result<void> valid = options.check(); !valid) return report_error(valid.error());
  const Result<std::unique_ptr<PairingHost>> host = PairingHost::open(options);
  if (!host) return report_error(host.error());
  show(reachable((*host)->endpoint()), options.code, std::chrono::duration_cast<std::chrono::seconds>(options.valid));
  const Wakeup never;
  const Result<AuthorisedDevice> paired = (*host)->wait(never);
  if (!paired) return report_error(paired.error());
  const nlohmann::json line = {{"device", paired->name}, {"device_public_key", paired->public_key}};
  std::printf("%s\n", line.dump().c_str());
  return 0;
}

int pair(const PairFlags& given) {
  const std::filesystem::path folder = given.store;
  const std::filesystem::path devices =
      given.devices.empty() ? folder / "devices" : std::filesystem::path(given.devices);
  if (!given.authorise.empty()) {
    if (given.name.empty()) return report_error(wrong_use("a device needs a name", "", "add --name NAME").value());
    if (const auto done = authorise_device(devices, given.name, given.authorise); !done)
      return report_error(done.error());
  }
  if (!given.revoke.empty()) {
    if (const auto done = revoke_device(devices, given.revoke); !done) return report_error(done.error());
  }
  const Result<KeyPair> keys =
      read_or_make_key_pair(given.key.empty() ? folder / "host.key" : std::filesystem::path(given.key));
  if (!keys) return report_error(keys.error());
  if (given.authorise.empty() && given.revoke.empty() && !given.list)
    return pair_by_code(given, keys->public_key, devices);
  nlohmann::json list = nlohmann::json::array();
  for (const AuthorisedDevice& device : authorised_devices(devices))
    list.push_back({{"name", device.name}, {"public_key", device.public_key}});
  std::printf("%s\n", nlohmann::json{{"host_public_key", keys->public_key}, {"devices", list}}.dump().c_str());
  return 0;
}

}  // namespace

void add_pair_verb(CLI::App& app, Verb& run) {
  const auto flags = std::make_shared<PairFlags>();
  CLI::App* verb = app.add_subcommand(
      "pair", "let one device in by a one-time code, valid for five minutes; or list devices, let in by key, shut out");
  verb->add_option("--store", flags->store, "folder of the catalogue and the scans")->required();
  verb->add_option("--key", flags->key, "file of the host's secret key, made when missing; default: STORE/host.key");
  verb->add_option("--devices", flags->devices,
                   "folder with the public keys of the devices let in; default: STORE/devices");
  verb->add_option("--endpoint", flags->endpoint, "where the device finds this pairing, tcp://ADDRESS:PORT")
      ->capture_default_str();
  verb->add_flag("--list", flags->list, "print the host's public key and the devices let in, and end");
  verb->add_option("--authorise", flags->authorise, "public key of a device to let in, instead of a code");
  verb->add_option("--name", flags->name, "name of that device");
  verb->add_option("--revoke", flags->revoke, "name of a device to shut out, at once and on open connections too");
  verb->callback([flags, &run] { run = [flags] { return pair(*flags); }; });
}

}  // namespace gyre
