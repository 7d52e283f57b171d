// SPDX-License-Identifier: Apache-2.0
// Points, normals and rays taken back from a posed body to the rest pose.
#pragma once

#include "offload/body/template.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace gyre {

// posed_from_rest of linear blend skinning at a point of the surface: corners and their barycentric weights.
Eigen::Affine3d posed_from_rest_at(const BodyTemplate& body, const Eigen::Vector3i& corners,
                                   const Eigen::Vector3d& weights, const std::vector<Eigen::Affine3d>& posed_from_rest);

// All of the same at one vertex.
Eigen::Affine3d posed_from_rest_at(const BodyTemplate& body, int vertex,
                                   const std::vector<Eigen::Affine3d>& posed_from_rest);

// What moves with the surface where `posed_from_rest` was taken, before the pose. A sight line that touches the posed
// surface there touches the rest surface after rest_ray() (Alldieck et al., "Video Based Reconstruction of 3D People
// Models", 2018, section 3.2). Normals go by the transposed matrix, as normals must.
Eigen::Vector3d rest_point(const Eigen::Affine3d& posed_from_rest, const Eigen::Vector3d& point);
Eigen::Vector3d rest_normal(const Eigen::Affine3d& posed_from_rest, const Eigen::Vector3d& normal);
Eigen::ParametrizedLine<double, 3> rest_ray(const Eigen::Affine3d& posed_from_rest,
                                            const Eigen::ParametrizedLine<double, 3>& ray);

}  // namespace gyre
