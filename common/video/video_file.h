// SPDX-License-Identifier: Apache-2.0
// Frames of a video file; open_capture is the way in.
#pragma once

#include "common/video/frame_source.h"

namespace gyre {

Result<std::unique_ptr<FrameSource>> open_video(const std::filesystem::path& file);

}  // namespace gyre
