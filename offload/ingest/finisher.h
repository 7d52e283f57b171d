// SPDX-License-Identifier: Apache-2.0
// Takes files that have arrived whole to their place in the store, beside the thread that receives more of them:
// hashing and waiting for the disk are most of what a file costs.
#pragma once

#include "common/result/result.h"
#include "common/wire/wire.h"
#include "offload/store/store.h"

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace gyre {

struct ArrivedFile {
  std::string scan;
  wire::FileEntry file;
  std::filesystem::path part;  // where it lies
};

struct FinishedFile {
  ArrivedFile arrived;
  Result<bool> stored;  // false: its bytes do not have its hash, and are gone. Error: the store cannot go on.
};

// Files go in order. What waits is done at a time: each is checked and synced, then the folders, then the catalogue; a
// file is finished when all of that is on disk.
class Finisher {
 public:
  // on_finished is called, from the finisher's thread, when take() has something. The store outlives it.
  Finisher(Store& store, std::function<void()> on_finished);
  ~Finisher();  // what has not been begun stays where it lies
  Finisher(const Finisher&) = delete;
  Finisher& operator=(const Finisher&) = delete;

  // Waits while too many are waiting, so that a device cannot send faster than the disk takes it.
  void add(ArrivedFile file);
  // Until all that was added is finished.
  void wait();
  std::vector<FinishedFile> take();

 private:
  void run();
  std::vector<FinishedFile> finish(std::deque<ArrivedFile> files);

  Store& store_;
  std::function<void()> on_finished_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<ArrivedFile> waiting_;
  std::vector<FinishedFile> finished_;
  bool at_work_ = false;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace gyre
