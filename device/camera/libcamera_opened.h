// SPDX-License-Identifier: Apache-2.0
// What belongs to libcamera of an opened camera, and how that ends.
#pragma once

#include "common/result/result.h"
#include "device/camera/libcamera_arrivals.h"
#include "device/camera/libcamera_buffer.h"

#include <libcamera/camera.h>
#include <libcamera/camera_manager.h>
#include <libcamera/framebuffer_allocator.h>
#include <map>
#include <memory>
#include <vector>

namespace gyre {

// There can be one manager in a process. It goes with the last camera, so that a camera that is opened again is looked
// for anew.
Result<std::shared_ptr<libcamera::CameraManager>> camera_manager();

struct OpenedLibcamera {
  std::shared_ptr<libcamera::CameraManager> keeper;
  std::shared_ptr<libcamera::Camera> camera;
  bool acquired = false;
  std::unique_ptr<libcamera::CameraConfiguration> configuration;  // the main stream, then the one for analysis
  std::unique_ptr<libcamera::FrameBufferAllocator> allocator;
  std::map<const libcamera::FrameBuffer*, std::unique_ptr<MappedBuffer>> buffers;
  std::vector<std::unique_ptr<libcamera::Request>> requests;
  Arrivals arrivals;

  OpenedLibcamera(std::shared_ptr<libcamera::CameraManager> manager, std::shared_ptr<libcamera::Camera> found);
  OpenedLibcamera(const OpenedLibcamera&) = delete;
  OpenedLibcamera& operator=(const OpenedLibcamera&) = delete;
  // Not while it streams.
  ~OpenedLibcamera();

  // Nobody else may use it from now on. Error: somebody does.
  Result<void> acquire();

  // Buffers of all streams of the configuration, and as many requests, each with one of every stream.
  Result<void> allocate();

  // Without its device nodes a camera is gone, whether libcamera has heard of it or not.
  bool gone() const;
};

// libcamera (0.3.2) ends the program when a camera that is gone is stopped, since its requests do not come back. So
// what belongs to it stays as it is until the program ends; a camera that is plugged in again is a new one.
void abandon(std::unique_ptr<OpenedLibcamera> opened);

}  // namespace gyre
