// SPDX-License-Identifier: Apache-2.0
// The page of the host: scans and their progress, avatars, reports, uploads, and what can be done with them.
#pragma once

#include "common/bundle/stage.h"
#include "common/http/event_stream.h"
#include "common/http/http_server.h"
#include "offload/page/recording_importer.h"
#include "offload/page/scan_view.h"
#include "offload/page/upload_desk.h"
#include "offload/store/store.h"

#include <condition_variable>
#include <functional>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace gyre {

// What the page asks of whoever works on scans. All may be called from several threads at once.
struct ScanActions {
  std::function<std::map<std::string, ScanActivity>()> work;  // of all scans that are worked on
  std::function<void(const std::string& scan)> queued;        // a job was queued
  std::function<Result<void>(const std::string& scan)> cancel;
  // changes: stage -> options that differ from what they were, checked.
  std::function<Result<void>(const std::string& scan, const nlohmann::json& changes)> rerun;
  std::function<Result<void>(const std::string& scan)> remove;
  std::function<std::vector<DeviceView>()> devices = [] { return std::vector<DeviceView>(); };
};

struct HostPageOptions {
  HttpOptions http;
  std::uint64_t reserve_bytes = 1 << 30;  // left free on the disk by uploads
};

// Serves between start() and stop().
class HostPage {
 public:
  // stages: in the order they run. The store outlives the page.
  HostPage(HostPageOptions options, Store& store, std::vector<Stage> stages, ScanActions actions);
  ~HostPage();  // stops
  HostPage(const HostPage&) = delete;
  HostPage& operator=(const HostPage&) = delete;

  // For routes that are not the page's own; before start().
  HttpServer& server() { return server_; }

  Result<void> start();
  void stop();

 private:
  void add_scan_routes();
  void add_file_routes();
  void add_upload_routes();
  void add_landmark_routes();
  void watch();
  void publish_changes();

  Result<StoredScan> find(const std::string& id) const;
  // What is looked up once for all rows.
  struct Look {
    std::map<std::string, ScanActivity> work;   // by scan
    std::map<std::string, DeviceView> devices;  // by key
  };
  Look look() const;
  nlohmann::json row_of(const StoredScan& scan, const Look& look) const;
  nlohmann::json rows() const;
  HttpResponse answer(const Result<void>& done) const;

  HostPageOptions options_;
  Store& store_;
  std::vector<Stage> stages_;
  ScanActions actions_;
  UploadDesk uploads_;
  RecordingImporter importer_;
  EventStream events_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool stopping_ = false;
  struct Told {
    StoredScan scan;
    nlohmann::json row;
    bool in_work = false;
  };
  std::map<std::string, Told> told_;  // by scan, what the watchers know; of the watching thread
  std::thread watcher_;
  HttpServer server_;  // goes first
};

}  // namespace gyre
