// SPDX-License-Identifier: Apache-2.0
// Verifies bundles that have come whole beside the threads that receive more of them: every keyframe is decoded, which
// takes seconds for a scan of large pictures.
#pragma once

#include "common/result/result.h"
#include "common/wire/wire.h"
#include "offload/store/store.h"

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace gyre {

struct CheckedBundle {
  std::string scan;
  Result<void> good;
};

// Scans go in order, one at a time.
class BundleChecker {
 public:
  // on_checked is called, from the checker's thread, when take() has something. The store outlives it.
  BundleChecker(const Store& store, std::function<void()> on_checked);
  ~BundleChecker();  // what has not been begun is not checked
  BundleChecker(const BundleChecker&) = delete;
  BundleChecker& operator=(const BundleChecker&) = delete;

  void add(std::string scan);
  // Until all that was added is checked.
  void wait();
  std::vector<CheckedBundle> take();

 private:
  void run();

  const Store& store_;
  std::function<void()> on_checked_;
  std::mutex mutex_;  // guards what follows
  std::condition_variable changed_;
  std::deque<std::string> waiting_;  // the one at work in front
  std::vector<CheckedBundle> checked_;
  bool stopping_ = false;
  std::thread thread_;
};

}  // namespace gyre
