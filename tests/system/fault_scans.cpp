// SPDX-License-Identifier: Apache-2.0
#include "tests/system/fault_scans.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"

#include <array>
#include <cstdio>

namespace gyre {

std::vector<int> fault_keyframes() {
  std::vector<int> chosen;
  for (int i = 0; i < fault_frames; ++i) {
    if (is_fault_keyframe(i)) chosen.push_back(i);
  }
  return chosen;
}

Scan fault_scan(int number) {
  Scan scan = small_scan();
  std::array<char, 27> id{};
  std::snprintf(id.data(), id.size(), "01FA%022d", number);
  scan.id = id.data();
  return scan;
}

std::vector<std::byte> fault_frame(int number, int frame) {
  const auto seed = static_cast<std::uint64_t>(1000 * number + frame);
  constexpr std::size_t least = 20'000;
  constexpr std::size_t spread = 600'000;  // so that some take several chunks
  return small_keyframe(seed, least + seed * 7919 * 104'729 % spread);
}

Result<std::string> fault_avatar(const Bundle& bundle) {
  std::string content;
  for (const std::filesystem::path& file : {bundle.scan_file(), bundle.frame_log()}) {
    const Result<std::string> text = read_file(file);
    if (!text) return text;
    content += *text;
  }
  const Result<std::string> frames = sha256_of_folder(bundle.frames());
  if (!frames) return frames;
  content += *frames;
  std::string avatar;
  constexpr int hashes = 6000;  // of 64 characters: two chunks
  for (int i = 0; i < hashes; ++i) avatar += sha256(content + std::to_string(i));
  return avatar;
}

}  // namespace gyre
