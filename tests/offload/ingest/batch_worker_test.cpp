// SPDX-License-Identifier: Apache-2.0
#include "offload/ingest/batch_worker.h"

#include <gtest/gtest.h>
#include <algorithm>
#include <future>
#include <numeric>
#include <vector>

namespace gyre {
namespace {

TEST(BatchWorker, DoesEverythingOnceAndInOrder) {
  for (const std::size_t at_once : {std::size_t{1}, std::size_t{7}, BatchLimits().at_once}) {
    std::size_t largest = 0;
    BatchWorker<int, int> worker(
        {.waiting = 3, .at_once = at_once},
        [&](std::vector<int> batch) {
          largest = std::max(largest, batch.size());
          for (int& value : batch) value *= 2;
          return batch;
        },
        [] {});
    for (int i = 0; i < 500; ++i) worker.add(i);
    worker.wait();
    std::vector<int> expected(500);
    std::iota(expected.begin(), expected.end(), 0);
    for (int& value : expected) value *= 2;
    EXPECT_EQ(worker.take(), expected);
    EXPECT_TRUE(worker.take().empty());
    EXPECT_LE(largest, std::min(at_once, std::size_t{3}));
  }
}

TEST(BatchWorker, SaysWhenThereIsSomethingToTake) {
  std::promise<void> done;
  BatchWorker<int, int> worker(
      {}, [](std::vector<int> batch) { return batch; }, [&] { done.set_value(); });
  worker.add(5);
  done.get_future().wait();
  EXPECT_EQ(worker.take(), std::vector<int>{5});
}

TEST(BatchWorker, WhoeverBringsTooMuchWaits) {
  std::promise<void> begun, go_on;
  std::vector<int> sizes;
  {
    BatchWorker<int, int> worker(
        {.waiting = 2},
        [&](std::vector<int> batch) {
          if (sizes.empty()) {
            begun.set_value();
            go_on.get_future().wait();
          }
          sizes.push_back(static_cast<int>(batch.size()));
          return batch;
        },
        [] {});
    worker.add(0);
    begun.get_future().wait();
    worker.add(1);
    worker.add(2);
    std::future<void> third = std::async(std::launch::async, [&] { worker.add(3); });
    go_on.set_value();
    third.wait();
    worker.wait();
  }
  EXPECT_EQ(std::accumulate(sizes.begin(), sizes.end(), 0), 4);
  EXPECT_EQ(sizes[1], 2);
}

}  // namespace
}  // namespace gyre
