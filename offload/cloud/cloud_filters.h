// SPDX-License-Identifier: Apache-2.0
// What is taken out of the fused cloud: the floor, sparse specks, and clusters that are not the subject.
#pragma once

#include "common/mesh/mesh.h"
#include "offload/cloud/subject_region.h"

#include <vector>

namespace gyre {

// Points whose flag is not zero, in their order. The cloud has everything but `views`, which are counted last.
PointCloud selected(const PointCloud& cloud, const std::vector<char>& keep);

// 0 for floor (the plane y = 0), 1 for the rest.
std::vector<char> above_floor(const PointCloud& cloud, const FloorOptions& options);

// 0 for points with fewer than `count` others within `radius` metres.
std::vector<char> well_surrounded(const PointCloud& cloud, double radius, int count);

struct ClusterOptions {
  double gap = 0.03;        // metres; points nearer than about this are connected
  double min_share = 0.02;  // of the heaviest cluster's weight, for a cluster to be kept
};

// 1 for points of the heaviest cluster and of others of at least min_share of its weight; clusters are connected
// components of occupied cubes with side `gap`, all 26 neighbours counted. A point weighs less the farther it is from
// the vertical axis through the region's centre, so that what stands at the border does not win.
std::vector<char> subject_clusters(const PointCloud& cloud, const SubjectRegion& region, const ClusterOptions& options);

}  // namespace gyre
