// SPDX-License-Identifier: Apache-2.0
// What differs between libcamera 0.3.2 and 0.7, and nothing else.
#pragma once

#include <libcamera/control_ids.h>
#include <libcamera/controls.h>
#include <libcamera/version.h>
#include <cstdint>
#include <optional>

#define GYRE_LIBCAMERA_AT_LEAST(major, minor) \
  (LIBCAMERA_VERSION_MAJOR > (major) || (LIBCAMERA_VERSION_MAJOR == (major) && LIBCAMERA_VERSION_MINOR >= (minor)))

namespace gyre::shim {

// Whether the automatic exposure has come to rest; nothing when the camera does not say. AeLocked became AeState in
// 0.5.
inline std::optional<bool> exposure_settled(const libcamera::ControlList& metadata) {
#if GYRE_LIBCAMERA_AT_LEAST(0, 5)
  const auto state = metadata.get(libcamera::controls::AeState);
  if (!state) return std::nullopt;
  return *state == libcamera::controls::AeStateConverged;
#else
  return metadata.get(libcamera::controls::AeLocked);
#endif
}

// Exposure and gain by hand, as far as the camera has them. Since 0.5 a value only counts when its mode is manual.
inline void hold_exposure(libcamera::ControlList& controls, const libcamera::ControlInfoMap& known,
                          std::optional<std::int32_t> exposure_us, std::optional<float> gain) {
  namespace ids = libcamera::controls;
#if GYRE_LIBCAMERA_AT_LEAST(0, 5)
  if (known.count(&ids::ExposureTimeMode) != 0) controls.set(ids::ExposureTimeMode, ids::ExposureTimeModeManual);
  if (known.count(&ids::AnalogueGainMode) != 0) controls.set(ids::AnalogueGainMode, ids::AnalogueGainModeManual);
#else
  if (known.count(&ids::AeEnable) != 0) controls.set(ids::AeEnable, false);
#endif
  if (exposure_us && known.count(&ids::ExposureTime) != 0) controls.set(ids::ExposureTime, *exposure_us);
  if (gain && known.count(&ids::AnalogueGain) != 0) controls.set(ids::AnalogueGain, *gain);
}

inline void free_exposure(libcamera::ControlList& controls, const libcamera::ControlInfoMap& known) {
  namespace ids = libcamera::controls;
#if GYRE_LIBCAMERA_AT_LEAST(0, 5)
  if (known.count(&ids::ExposureTimeMode) != 0) controls.set(ids::ExposureTimeMode, ids::ExposureTimeModeAuto);
  if (known.count(&ids::AnalogueGainMode) != 0) controls.set(ids::AnalogueGainMode, ids::AnalogueGainModeAuto);
#else
  if (known.count(&ids::AeEnable) != 0) controls.set(ids::AeEnable, true);
#endif
}

}  // namespace gyre::shim
