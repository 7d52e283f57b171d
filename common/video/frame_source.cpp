// SPDX-License-Identifier: Apache-2.0
#include "common/video/frame_source.h"

#include "common/video/image_folder.h"
#include "common/video/video_file.h"

namespace gyre {

Result<std::unique_ptr<FrameSource>> open_capture(const std::filesystem::path& path) {
  std::error_code error;
  const std::filesystem::file_status status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return fail("no such capture", path.string(), "give a video file or a folder of JPEG or PNG");
  }
  return std::filesystem::is_directory(status) ? open_image_folder(path) : open_video(path);
}

}  // namespace gyre
