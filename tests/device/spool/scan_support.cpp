// SPDX-License-Identifier: Apache-2.0
#include "tests/device/spool/scan_support.h"

#include "common/bundle/ulid.h"

#include <turbojpeg.h>
#include <chrono>
#include <condition_variable>
#include <mutex>
#include <random>

namespace gyre {

namespace {

// 16 x 16 pixels of one colour.
std::vector<unsigned char> small_jpeg(unsigned char blue) {
  constexpr int side = 16;
  constexpr int quality = 95;
  std::vector<unsigned char> pixels;
  for (int i = 0; i < side * side; ++i) pixels.insert(pixels.end(), {blue, 80, 160});
  const tjhandle handle = tjInitCompress();
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  tjCompress2(handle, pixels.data(), side, 0, side, TJPF_BGR, &bytes, &size, TJSAMP_420, quality, 0);
  std::vector<unsigned char> jpeg(bytes, bytes + size);
  tjFree(bytes);
  tjDestroy(handle);
  return jpeg;
}

}  // namespace

Scan small_scan() {
  Scan scan;
  scan.id = new_ulid();
  scan.device = "rig";
  scan.created = "2026-01-01T00:00:00Z";
  scan.software = "test";
  scan.passes.push_back({"body", 30.0, 100, 16, 16});
  return scan;
}

std::vector<std::byte> small_keyframe(std::uint64_t seed, std::size_t size) {
  std::vector<unsigned char> jpeg = small_jpeg(static_cast<unsigned char>(seed % 256));
  std::mt19937_64 random(seed);
  while (jpeg.size() < size) jpeg.push_back(static_cast<unsigned char>(random() & 0xff));
  const auto bytes = std::as_bytes(std::span(jpeg));
  return {bytes.begin(), bytes.end()};
}

std::string keyframe_name(int index) {
  return "frames/" + frame_name("body", index);
}

std::vector<FrameRecord> small_records(int count, const std::vector<int>& keyframes) {
  std::vector<FrameRecord> records;
  for (int i = 0; i < count; ++i) {
    FrameRecord record;
    record.pass = "body";
    record.index = i;
    record.time = i / 30.0;
    const bool chosen = std::find(keyframes.begin(), keyframes.end(), i) != keyframes.end();
    record.decision = chosen ? "keyframe" : "skipped";
    record.reason = "test";
    records.push_back(record);
  }
  return records;
}

Result<void> spool_scan(Spool& spool, const Scan& scan, const std::vector<int>& keyframes, std::size_t size,
                        std::uint64_t seed) {
  if (Result<void> opened = spool.open_scan(scan); !opened) return opened;
  for (const int index : keyframes) {
    const std::vector<std::byte> bytes = small_keyframe(seed + static_cast<std::uint64_t>(index), size);
    if (Result<void> added = spool.add_file(scan.id, keyframe_name(index), bytes); !added) return added;
  }
  return spool.close_scan(scan, small_records(keyframes.empty() ? 0 : keyframes.back() + 1, keyframes));
}

bool eventually(const std::function<bool()>& condition) {
  std::mutex mutex;
  std::condition_variable tick;
  std::unique_lock lock(mutex);
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    tick.wait_for(lock, std::chrono::milliseconds(2));
  }
  return true;
}

}  // namespace gyre
