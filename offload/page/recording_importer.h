// SPDX-License-Identifier: Apache-2.0
// Turns finished uploads into scans of the store, one after the other.
#pragma once

#include "offload/page/scan_view.h"
#include "offload/page/upload_desk.h"
#include "offload/store/store.h"

#include <atomic>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace gyre {

// Works on a thread of its own between start() and stop(); the other methods may be called from any. What a stop or a
// crash interrupts starts over the next time.
class RecordingImporter {
 public:
  // on_queued: the scan's job was queued. Must return soon.
  RecordingImporter(Store& store, UploadDesk& desk, std::function<void(const std::string& scan)> on_queued)
      : store_(store), desk_(desk), on_queued_(std::move(on_queued)) {}
  ~RecordingImporter() { stop(); }
  RecordingImporter(const RecordingImporter&) = delete;
  RecordingImporter& operator=(const RecordingImporter&) = delete;

  // Goes on with the uploads that are there.
  void start();
  void stop();

  // Puts the finished upload of that id into the store's list and imports it. The scan's id is the upload's.
  Result<void> add(const std::string& id);
  // What is being done to a scan that is not imported yet.
  std::optional<ScanActivity> work(const std::string& id) const;
  // The upload is not wanted any more; one that is being imported ends first.
  void drop(const std::string& id);

 private:
  void run();
  void import(const Upload& upload);
  Result<void> bring_in(const Upload& upload);

  Store& store_;
  UploadDesk& desk_;
  std::function<void(const std::string&)> on_queued_;
  std::thread thread_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<Upload> waiting_;
  std::string current_;  // id
  ScanActivity work_;    // of the current one
  std::atomic<bool> cancelled_{false};
  bool stopping_ = false;
};

}  // namespace gyre
