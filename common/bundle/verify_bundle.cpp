// SPDX-License-Identifier: Apache-2.0
#include "common/bundle/bundle.h"

#include <map>
#include <opencv2/imgcodecs.hpp>

namespace gyre {

Result<void> verify_bundle(const Bundle& bundle) {
  const Result<Scan> scan = read_scan(bundle);
  if (!scan) return tl::unexpected(scan.error());
  const Result<std::vector<FrameRecord>> log = read_frame_log(bundle);
  if (!log) return tl::unexpected(log.error());
  std::error_code error;
  for (const FrameRecord& r : *log) {
    if (r.decision == "keyframe" && !std::filesystem::exists(bundle.frame(r.pass, r.index), error)) {
      return fail("a keyframe is missing", bundle.frame(r.pass, r.index).string(), "send the scan again");
    }
  }
  std::map<std::string, cv::Size> sizes;
  for (const auto& entry : std::filesystem::directory_iterator(bundle.frames(), error)) {
    const std::string name = entry.path().filename().string();
    const std::optional<FrameId> id = parse_frame_name(name);
    if (!id) return fail("a foreign file lies among the keyframes", entry.path().string(), "remove it");
    const cv::Mat image = cv::imread(entry.path().string(), cv::IMREAD_REDUCED_GRAYSCALE_8);
    if (image.empty()) return fail("a keyframe cannot be decoded", entry.path().string(), "send the scan again");
    const auto [it, first] = sizes.emplace(id->pass, image.size());
    if (!first && it->second != image.size())
      return fail("keyframes of one pass differ in size", entry.path().string());
  }
  if (error) return fail("cannot list keyframes", bundle.frames().string() + " (" + error.message() + ")");
  return {};
}

}  // namespace gyre
