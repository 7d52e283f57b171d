// SPDX-License-Identifier: Apache-2.0
#include "common/board/markers.h"

#include <opencv2/core/version.hpp>

#define GYRE_MARKERS_IN_CORE (CV_VERSION_MAJOR > 4 || (CV_VERSION_MAJOR == 4 && CV_VERSION_MINOR >= 7))
#if GYRE_MARKERS_IN_CORE
#include <opencv2/objdetect/aruco_detector.hpp>
#else
#include <opencv2/aruco.hpp>
#endif

namespace gyre {

namespace {

constexpr auto dictionary_name = cv::aruco::DICT_4X4_50;

// One window of thresholding instead of three costs a third and finds as many of these markers, whose outline is
// seldom broader than it.
template <class Parameters>
void set(Parameters& parameters) {
  parameters.adaptiveThreshWinSizeMin = 13;
  parameters.adaptiveThreshWinSizeMax = 13;
  parameters.minMarkerPerimeterRate = 0.02;
}

}  // namespace

MarkerModules black_modules(int id) {
  cv::Mat drawn;
#if GYRE_MARKERS_IN_CORE
  cv::aruco::getPredefinedDictionary(dictionary_name).generateImageMarker(id, marker_modules, drawn);
#else
  cv::aruco::getPredefinedDictionary(dictionary_name)->drawMarker(id, marker_modules, drawn);
#endif
  MarkerModules black{};
  for (int row = 0; row < marker_modules; ++row)
    for (int column = 0; column < marker_modules; ++column)
      black[static_cast<std::size_t>(row)][static_cast<std::size_t>(column)] = drawn.at<std::uint8_t>(row, column) == 0;
  return black;
}

std::vector<FoundMarker> find_markers(const cv::Mat& grey) {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
#if GYRE_MARKERS_IN_CORE
  cv::aruco::DetectorParameters parameters;
  set(parameters);
  cv::aruco::ArucoDetector(cv::aruco::getPredefinedDictionary(dictionary_name), parameters)
      .detectMarkers(grey, corners, ids);
#else
  const auto parameters = cv::aruco::DetectorParameters::create();
  set(*parameters);
  cv::aruco::detectMarkers(grey, cv::aruco::getPredefinedDictionary(dictionary_name), corners, ids, parameters);
#endif
  std::vector<FoundMarker> markers(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    markers[i].id = ids[i];
    std::copy_n(corners[i].begin(), 4, markers[i].corners.begin());
  }
  return markers;
}

}  // namespace gyre
