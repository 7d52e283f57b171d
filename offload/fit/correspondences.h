// SPDX-License-Identifier: Apache-2.0
// Pairs of surface points of the template and places on the cloud, found in both directions.
#pragma once

#include "offload/body/template.h"
#include "offload/fit/point_index.h"

#include <Eigen/Core>
#include <span>
#include <vector>

namespace gyre {

// The outside of the template: what a camera could see of it in some pose. Vertex and triangle ids are the template's.
struct OuterSurface {
  std::vector<int> vertices;
  std::vector<Eigen::Vector3i> triangles;          // the body part's, without the inner ones
  std::vector<std::vector<int>> vertex_triangles;  // per template vertex, into `triangles`
};
OuterSurface outer_surface(const BodyTemplate& body);

// A point of the surface, weights . corners, and where it should be.
struct Match {
  Eigen::Vector3i corners = Eigen::Vector3i::Zero();
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  // barycentric
  Eigen::Vector3d target = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // of the surface at that point, unit
  double offset = 0.0;                               // metres the target lies outside of the surface
  double weight = 1.0;                               // of the cloud's evidence
};

// The surface in one pose, ready to be searched.
struct SearchableSurface {
  SearchableSurface(const OuterSurface& outer, std::span<const Eigen::Vector3d> vertices,
                    std::span<const Eigen::Vector3d> normals);
  const OuterSurface* outer;
  std::span<const Eigen::Vector3d> vertices;  // of the whole template
  std::span<const Eigen::Vector3d> normals;
  PointIndex index;  // over outer->vertices
};

// Where on the surface a match is, given the vertices it is made of.
inline Eigen::Vector3d place_of(const Match& match, std::span<const Eigen::Vector3d> vertices) {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) place += match.weights[k] * vertices[match.corners[k]];
  return place;
}

// For each cloud point the closest surface point among the triangles around the closest compatible vertex.
std::vector<Match> match_cloud(const OrientedPoints& cloud, const SearchableSurface& surface, const MatchGate& gate,
                               int threads);

// For each given vertex the cloud's plane beside it: the target is the vertex moved along the plane's normal. Vertices
// whose compatible cloud point lies more than `max_slide` metres along the surface have no counterpart: they look into
// a hole.
std::vector<Match> match_vertices(std::span<const int> vertices, const SearchableSurface& surface,
                                  const PointIndex& cloud, const MatchGate& gate, double max_slide, int threads);

}  // namespace gyre
