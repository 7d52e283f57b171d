// SPDX-License-Identifier: Apache-2.0
// A host and a device on loopback for the tests of the link, each of which can go down and come back.
#pragma once

#include "device/uplink/uplink.h"
#include "offload/ingest/ingest_server.h"
#include "tests/device/spool/scan_support.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

namespace gyre {

// The host: store and ingest. After the first start it keeps its port.
class TestHost {
 public:
  TestHost();

  void start();
  void stop();
  const std::filesystem::path& folder() const { return folder_.path(); }
  Store& store() { return *store_; }
  IngestServer& server() { return *server_; }
  const IngestOptions& options() const { return options_; }
  void authorise(const KeyPair& device);
  void set_credit(std::uint64_t bytes) { options_.credit_bytes = bytes; }
  void set_reserve(std::uint64_t bytes) { options_.reserve_bytes = bytes; }
  void set_silence_timeout(std::chrono::milliseconds timeout) { options_.silence_timeout = timeout; }

  // Scans handed to the pipeline so far, in order.
  std::vector<std::string> queued() const;

  // Does what the pipeline does for every queued job: writes avatar.glb and report.json made of the scan's files.
  void run_jobs();

 private:
  TemporaryFolder folder_;
  IngestOptions options_;
  std::unique_ptr<Store> store_;
  std::unique_ptr<IngestServer> server_;
  mutable std::mutex mutex_;
  std::vector<std::string> queued_;
};

// The device: spool and uplink.
class TestDevice {
 public:
  explicit TestDevice(std::string name);

  void open_spool();
  void connect(const TestHost& host) { connect(host, host.options().endpoint); }
  void connect(const TestHost& host, const std::string& endpoint);  // by another way than straight
  void disconnect() { uplink_.reset(); }
  void stop();
  Spool& spool() { return *spool_; }
  Uplink& uplink() { return *uplink_; }
  UplinkOptions& options() { return options_; }

 private:
  TemporaryFolder folder_;
  UplinkOptions options_;
  std::unique_ptr<Spool> spool_;
  std::unique_ptr<Uplink> uplink_;
};

// What the pipeline of run_jobs makes of a bundle: depends on every byte of every file.
std::string avatar_of(const Bundle& bundle);

// Size of everything in a folder. Tests cut the link off at some amount that has arrived.
std::uint64_t bytes_below(const std::filesystem::path& folder);

// What spdlog has been told since the object was made.
class LogCapture {
 public:
  LogCapture();
  ~LogCapture();
  LogCapture(const LogCapture&) = delete;
  LogCapture& operator=(const LogCapture&) = delete;
  bool has(const std::string& text) const;

 private:
  struct Sink;
  std::shared_ptr<Sink> sink_;
};

}  // namespace gyre
