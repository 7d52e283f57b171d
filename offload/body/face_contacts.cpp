// SPDX-License-Identifier: Apache-2.0
#include "offload/body/face_contacts.h"

#include <Eigen/Geometry>
#include <queue>

namespace gyre {

namespace {

constexpr int skin_rings = 4;                // of triangles beside the rim that may touch, on the skin ...
constexpr int lining_rings = 1;              // ... and on the lining
constexpr double eye_reach = 0.022;          // metres along the surface from the rim that a correction may move ...
constexpr double mouth_reach = 0.035;        // ... of an eye, of the mouth
constexpr int lip_rings = 4, lid_rings = 2;  // of these, those that can meet the other side
constexpr double corner_share = 0.08;   // of the opening's width beside each corner where sides do not face each other
constexpr double clearance = 3e-4;      // metres between the skin and what is behind it
constexpr double lid_thickness = 5e-3;  // metres; skin further from an eyeball never comes to lie on it
constexpr double near = 1.5e-3;         // metres; contacts that may come about while others are mended
constexpr double deepest = 0.02;        // metres; further apart is not the same contact
constexpr double firm = 1e-5, loose = 1e-2;  // softness of what must be and of what should
constexpr double good_enough = 2e-5;         // metres
constexpr int most_rounds = 12;

double rim_reach(const FaceOpening& opening) {
  return opening.name == "mouth" ? mouth_reach : eye_reach;
}

// Vertices in rings around the rim: ring 0 is the rim; `upper` and `lower` say which half is nearer, corners neither.
struct Rings {
  std::map<int, int> ring;
  std::set<int> upper, lower;
};

std::map<int, std::set<int>> neighbours(std::span<const Eigen::Vector3i> triangles) {
  std::map<int, std::set<int>> beside;
  for (const Eigen::Vector3i& t : triangles)
    for (int k = 0; k < 3; ++k) {
      beside[t[k]].insert(t[(k + 1) % 3]);
      beside[t[k]].insert(t[(k + 2) % 3]);
    }
  return beside;
}

Rings grow_rings(const BodyTemplate& body, const FaceOpening& opening, const std::map<int, std::set<int>>& beside) {
  Rings rings;
  std::vector<int> front;
  for (const auto* half : {&opening.upper, &opening.lower})
    for (std::size_t i = 0; i < half->size(); ++i) {
      const int v = (*half)[i];
      if (!rings.ring.try_emplace(v, 0).second) continue;
      front.push_back(v);
      if (i > 0 && i + 1 < half->size()) (half == &opening.upper ? rings.upper : rings.lower).insert(v);
    }
  for (int ring = 1; ring <= skin_rings; ++ring) {
    std::vector<int> next;
    for (const int v : front)
      for (const int b : beside.at(v)) {
        const bool inner = body.regions[b] == BodyRegion::inner;
        if (inner && ring > lining_rings) continue;
        if (!rings.ring.try_emplace(b, ring).second) continue;
        if (rings.upper.count(v)) rings.upper.insert(b);
        if (rings.lower.count(v)) rings.lower.insert(b);
        next.push_back(b);
      }
    front = std::move(next);
  }
  return rings;
}

// The skin beside the rim: for each rim vertex the neighbour most nearly abreast of it, for
// a corner the one furthest out, so that both halves end in the same vertices.
std::vector<int> edge_of(const std::vector<int>& rim, const BodyTemplate& body, const Rings& rings,
                         const std::map<int, std::set<int>>& beside) {
  const auto& x = body.mesh.vertices;
  const std::size_t last = rim.size() - 1;
  std::vector<int> edge;
  for (std::size_t i = 0; i <= last; ++i) {
    const bool corner = i == 0 || i == last;
    const Eigen::Vector3d along =
        corner ? Eigen::Vector3d(x[rim[i]] - x[rim[last - i]]) : Eigen::Vector3d(x[rim[i + 1]] - x[rim[i - 1]]);
    int best = -1;
    double least = std::numeric_limits<double>::infinity();
    for (const int b : beside.at(rim[i])) {
      const auto found = rings.ring.find(b);
      if (found == rings.ring.end() || found->second != 1 || body.regions[b] == BodyRegion::inner) continue;
      const Eigen::Vector3d aside = x[b] - x[rim[i]];
      const double cosine = aside.dot(along) / std::max(1e-12, aside.norm() * along.norm());
      const double cost = corner ? -cosine : std::abs(cosine);
      if (cost >= least) continue;
      least = cost;
      best = b;
    }
    edge.push_back(best >= 0 ? best : rim[i]);
  }
  return edge;
}

std::vector<int> without_repeats(std::vector<int> chain) {
  chain.erase(std::unique(chain.begin(), chain.end()), chain.end());
  return chain;
}

// Vertices no further than `reach` along the edges from the rim.
std::vector<int> within_reach(const std::vector<Eigen::Vector3d>& x, const FaceOpening& opening,
                              const std::map<int, std::set<int>>& beside, double reach) {
  std::map<int, double> distance;
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  for (const auto* half : {&opening.upper, &opening.lower})
    for (const int v : *half) {
      distance[v] = 0.0;
      queue.emplace(0.0, v);
    }
  while (!queue.empty()) {
    const auto [d, v] = queue.top();
    queue.pop();
    if (d > distance[v]) continue;
    for (const int b : beside.at(v)) {
      const double further = d + (x[b] - x[v]).norm();
      if (further > reach) continue;
      const auto [found, fresh] = distance.try_emplace(b, further);
      if (!fresh && further >= found->second) continue;
      found->second = further;
      queue.emplace(further, b);
    }
  }
  std::vector<int> reached;
  for (const auto& [v, d] : distance) reached.push_back(v);
  return reached;
}

// A surface seen along an axis.
struct Hit {
  Eigen::Vector3i corners = Eigen::Vector3i::Zero();
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();
  double height = 0.0;  // along the axis, from the point that looks
};

// Triangles as a height field along `axis`: what lies over or under a point.
class HeightField {
 public:
  HeightField(const std::vector<Eigen::Vector3d>& x, const std::vector<Eigen::Vector3i>& triangles,
              const Eigen::Vector3d& axis, const Eigen::Vector3d& side)
      : axis_(axis), side_(side), other_(axis.cross(side)) {
    for (const Eigen::Vector3i& t : triangles) {
      Face face;
      face.corners = t;
      for (int k = 0; k < 3; ++k) {
        face.plane.col(k) << side_.dot(x[t[k]]), other_.dot(x[t[k]]);
        face.height[k] = axis_.dot(x[t[k]]);
      }
      face.low = face.plane.rowwise().minCoeff();
      face.high = face.plane.rowwise().maxCoeff();
      faces_.push_back(face);
    }
  }

  // The highest (or lowest) surface on the line through p; nothing where there is none within `deepest`.
  std::optional<Hit> look(const Eigen::Vector3d& p, bool highest) const {
    const Eigen::Vector2d at(side_.dot(p), other_.dot(p));
    const double own = axis_.dot(p);
    std::optional<Hit> best;
    for (const Face& f : faces_) {
      if ((at.array() < f.low.array()).any() || (at.array() > f.high.array()).any()) continue;
      Eigen::Matrix2d sides;
      sides << f.plane.col(1) - f.plane.col(0), f.plane.col(2) - f.plane.col(0);
      const double area = sides.determinant();
      if (std::abs(area) < 1e-12) continue;
      const Eigen::Vector2d w = sides.inverse() * (at - f.plane.col(0));
      const Eigen::Vector3d weights(1.0 - w.sum(), w[0], w[1]);
      if (weights.minCoeff() < 0) continue;
      const double height = weights.dot(f.height) - own;
      if (std::abs(height) > deepest || (best && (height > best->height) != highest)) continue;
      best = Hit{f.corners, weights, height};
    }
    return best;
  }

 private:
  struct Face {
    Eigen::Vector3i corners;
    Eigen::Matrix<double, 2, 3> plane;
    Eigen::Vector3d height;
    Eigen::Vector2d low, high;
  };
  Eigen::Vector3d axis_, side_, other_;
  std::vector<Face> faces_;
};

// An eyeball as heights over its middle: what skin lies on.
class Ball {
 public:
  Ball(const std::vector<Eigen::Vector3d>& x, const std::vector<Eigen::Vector3i>& triangles) {
    for (const Eigen::Vector3i& t : triangles)
      for (const int v : t) middle_ += x[v] / (3.0 * static_cast<double>(triangles.size()));
    for (const Eigen::Vector3i& t : triangles) {
      Face face;
      Eigen::Matrix3d corners;
      for (int k = 0; k < 3; ++k) corners.col(k) = x[t[k]] - middle_;
      face.weights_from_place = corners.inverse();
      face.towards = corners.rowwise().sum().normalized();
      for (int k = 0; k < 3; ++k)
        face.least_cosine = std::min(face.least_cosine, face.towards.dot(corners.col(k).normalized()));
      faces_.push_back(face);
    }
  }

  Eigen::Vector3d outwards(const Eigen::Vector3d& p) const { return (p - middle_).normalized(); }

  // How far p lies outside, along the ray from the middle; nothing where the ball is open.
  std::optional<double> clear(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d out = outwards(p);
    for (const Face& f : faces_) {
      if (f.towards.dot(out) < f.least_cosine - 1e-9) continue;
      // Of the corners, all >= 0 where the ray hits, at a distance of 1 / sum(w).
      const Eigen::Vector3d w = f.weights_from_place * out;
      if (w.minCoeff() < -1e-9 * w.cwiseAbs().maxCoeff()) continue;
      return (p - middle_).norm() - 1.0 / w.sum();
    }
    return std::nullopt;
  }

 private:
  struct Face {
    Eigen::Matrix3d weights_from_place;
    Eigen::Vector3d towards;
    double least_cosine = 1.0;  // of its corners with `towards`
  };
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  std::vector<Face> faces_;
};

// Both sides of an opening and what is behind it, in one state; an eyeball all round as well.
struct Fields {
  HeightField upper, lower, behind;
  std::optional<Ball> ball;
};

// How far p stands clear of the other side; nothing where it faces none.
std::optional<std::pair<double, Hit>> clear_of_other(const Fields& fields, const Eigen::Vector3d& p, bool upper) {
  const auto hit = upper ? fields.lower.look(p, true) : fields.upper.look(p, false);
  if (!hit) return std::nullopt;
  return std::pair(upper ? -hit->height : hit->height, *hit);
}

std::optional<double> clear_of_back(const Fields& fields, const Eigen::Vector3d& p, bool all_round) {
  if (all_round) return fields.ball->clear(p);
  const auto hit = fields.behind.look(p, true);
  if (!hit) return std::nullopt;
  return -hit->height;
}

template <class Sides>
Fields fields_of(const Sides& sides, const OpeningFrame& frame, const std::vector<Eigen::Vector3d>& x) {
  Fields fields{HeightField(x, sides.upper, frame.up, frame.across),
                HeightField(x, sides.lower, frame.up, frame.across),
                HeightField(x, sides.behind, frame.out, frame.across), std::nullopt};
  if (sides.rim.name != "mouth") fields.ball.emplace(x, sides.behind);
  return fields;
}

}  // namespace

FaceContacts::Sides FaceContacts::find_sides(const BodyTemplate& body, const FaceOpening& opening) {
  const TemplatePart& skin = *body.part("body");
  const std::span<const Eigen::Vector3i> triangles(body.mesh.triangles.data() + skin.first_triangle,
                                                   static_cast<std::size_t>(skin.triangle_count));
  const auto beside = neighbours(triangles);
  const Rings rings = grow_rings(body, opening, beside);
  Sides sides;
  sides.rim = opening;
  sides.edge.name = opening.name;
  for (const auto& [rim, edge] :
       {std::pair(&opening.upper, &sides.edge.upper), std::pair(&opening.lower, &sides.edge.lower)}) {
    *edge = edge_of(*rim, body, rings, beside);
    for (std::size_t i = 1; i + 1 < rim->size(); ++i) sides.margin.push_back({(*rim)[i], (*edge)[i]});
    *edge = without_repeats(std::move(*edge));
  }
  // Beyond the corners the two sides lie beside each other and not one above the other.
  const std::vector<Eigen::Vector3d>& x = body.mesh.vertices;
  sides.template_frame = opening_frame(opening, x);
  const Eigen::Vector3d corner = x[opening.upper.front()], across = sides.template_frame.across;
  const double width = across.dot(x[opening.upper.back()] - corner);
  const auto between_corners = [&](int v, double margin) {
    const double place = across.dot(x[v] - corner) / width;
    return place > margin && place < 1.0 - margin;
  };
  for (const Eigen::Vector3i& t : triangles) {
    const auto all_of = [&](const std::set<int>& half) {
      return std::all_of(t.begin(), t.end(), [&](int v) { return half.count(v) && between_corners(v, 0.0); });
    };
    if (all_of(rings.upper)) sides.upper.push_back(t);
    if (all_of(rings.lower)) sides.lower.push_back(t);
  }
  const std::vector<std::string> backs =
      opening.name == "mouth" ? std::vector<std::string>{"upperTeeth", "lowerTeeth"} : std::vector{opening.name};
  for (const std::string& name : backs)
    if (const TemplatePart* part = body.part(name)) {
      const auto first = body.mesh.triangles.begin() + part->first_triangle;
      sides.behind.insert(sides.behind.end(), first, first + part->triangle_count);
    }

  // What the template has on the wrong side at rest says nothing about the person.
  const Fields fields = fields_of(sides, sides.template_frame, x);
  const int meeting = opening.name == "mouth" ? lip_rings : lid_rings;
  std::vector<int> touchable;
  for (const auto& [v, ring] : rings.ring) {
    touchable.push_back(v);
    const bool upper = rings.upper.count(v) > 0;
    if ((upper || rings.lower.count(v)) && between_corners(v, corner_share) && ring <= meeting) {
      const auto other = clear_of_other(fields, x[v], upper);
      sides.against_other.push_back({v, upper, other ? std::min(0.0, other->first) : 0.0});
    }
    if (ring > 0 && body.regions[v] != BodyRegion::inner)
      sides.against_back.push_back({v, upper, clear_of_back(fields, x[v], false).value_or(clearance)});
  }
  const std::vector<int> reach = within_reach(x, opening, beside, rim_reach(opening));
  if (fields.ball) {
    for (const int v : reach) {
      if (body.regions[v] == BodyRegion::inner || rings.ring.count(v)) continue;
      const auto clear = fields.ball->clear(x[v]);
      if (!clear || *clear > lid_thickness) continue;
      touchable.push_back(v);
      sides.against_back.push_back({v, false, *clear, true});
    }
  }
  const std::vector<RimPair> pairs = pair_rims(sides.edge, x, sides.template_frame);
  // Vertices beyond the other rim's ends face nothing.
  for (const RimPair& pair : pairs)
    if (pair.weight > 0 && pair.weight < 1) sides.closed.push_back(pair);
  for (const RimPair& pair : pairs)
    sides.template_gap += sides.template_frame.up.dot(gap_of(pair, x)) / static_cast<double>(pairs.size());
  sides.correction.emplace(x, triangles, reach, touchable);
  return sides;
}

FaceContacts::FaceContacts(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest) {
  for (const FaceOpening& opening : find_face_openings(body)) {
    sides_.push_back(find_sides(body, opening));
    sides_.back().frame = opening_frame(opening, rest);
  }
}

std::vector<FaceContacts::Watched> FaceContacts::before_back(const Sides& sides,
                                                             const std::vector<Eigen::Vector3d>& template_state) {
  const Fields fields = fields_of(sides, sides.template_frame, template_state);
  std::vector<Watched> before;
  for (Watched w : sides.against_back) {
    w.floor = std::min(clearance,
                       std::max(w.floor, clear_of_back(fields, template_state[w.vertex], w.all_round).value_or(0.0)));
    if (w.floor > 0) before.push_back(w);
  }
  return before;
}

bool FaceContacts::shuts(const Sides& sides, const std::vector<Eigen::Vector3d>& template_state) {
  constexpr double open = 1e-3;       // metres
  constexpr double shut_share = 0.2;  // of the gap at rest
  if (sides.rim.name == "mouth" || sides.template_gap < open) return false;
  const std::vector<RimPair> pairs = pair_rims(sides.edge, template_state, sides.template_frame);
  double gap = 0.0;
  for (const RimPair& pair : pairs)
    gap += sides.template_frame.up.dot(gap_of(pair, template_state)) / static_cast<double>(pairs.size());
  return gap < shut_share * sides.template_gap;
}

ContactState FaceContacts::measure(std::size_t i, const std::vector<Eigen::Vector3d>& state,
                                   const std::vector<Eigen::Vector3d>& template_state) const {
  const Sides& sides = sides_[i];
  const Fields fields = fields_of(sides, sides.frame, state);
  ContactState found;
  for (const Watched& w : sides.against_other)
    if (const auto clear = clear_of_other(fields, state[w.vertex], w.upper))
      found.crossing = std::max(found.crossing, w.floor - clear->first);
  for (const Watched& w : before_back(sides, template_state))
    if (const auto clear = clear_of_back(fields, state[w.vertex], w.all_round))
      found.penetration = std::max(found.penetration, -*clear);
  const std::vector<RimPair> pairs = pair_rims(sides.edge, state, sides.frame);
  found.widest_gap = -std::numeric_limits<double>::infinity();
  for (const RimPair& pair : pairs) {
    const double gap = sides.frame.up.dot(gap_of(pair, state));
    found.widest_gap = std::max(found.widest_gap, gap);
    found.mean_gap += gap / static_cast<double>(pairs.size());
  }
  return found;
}

std::vector<MotionCondition> FaceContacts::conditions(const Sides& sides, const std::vector<Watched>& before_back,
                                                      const std::vector<Eigen::Vector3d>& state, bool shut) {
  const OpeningFrame& frame = sides.frame;
  const Fields fields = fields_of(sides, frame, state);
  std::vector<MotionCondition> wanted;
  for (const Watched& w : sides.against_other) {
    const auto clear = clear_of_other(fields, state[w.vertex], w.upper);
    if (!clear || clear->first > near) continue;
    const double sign = w.upper ? 1.0 : -1.0;
    const auto& [gap, hit] = *clear;
    wanted.push_back({{w.vertex, hit.corners[0], hit.corners[1], hit.corners[2]},
                      {sign, -sign * hit.weights[0], -sign * hit.weights[1], -sign * hit.weights[2]},
                      frame.up,
                      w.floor - gap,
                      false});
  }
  for (const Watched& w : before_back) {
    const auto clear = clear_of_back(fields, state[w.vertex], w.all_round);
    if (!clear || *clear > near) continue;
    const Eigen::Vector3d out = w.all_round ? fields.ball->outwards(state[w.vertex]) : frame.out;
    wanted.push_back({{w.vertex, 0, 0, 0}, {1, 0, 0, 0}, out, w.floor - *clear, false});
  }
  if (!shut) return wanted;
  // The upper lid comes to the lower one, which keeps its height.
  for (const RimPair& pair : sides.closed) {
    const Eigen::Vector3d gap = gap_of(pair, state);
    const double sign = pair.upper ? 1.0 : -1.0;
    for (const Eigen::Vector3d& axis : {frame.up, frame.out})
      wanted.push_back({{pair.vertex, pair.opposite[0], pair.opposite[1], 0},
                        {sign, -sign * (1.0 - pair.weight), -sign * pair.weight, 0},
                        axis,
                        -axis.dot(gap),
                        true,
                        firm});
  }
  // Rims go with their edges, so that the lids' margins stay turned inwards.
  for (const auto& [rim, edge] : sides.margin)
    for (const Eigen::Vector3d& axis : {frame.across, frame.up, frame.out})
      wanted.push_back({{rim, edge, 0, 0}, {1, -1, 0, 0}, axis, 0.0, true, loose});
  for (std::size_t k = 1; k + 1 < sides.edge.lower.size(); ++k)
    wanted.push_back({{sides.edge.lower[k], 0, 0, 0}, {1, 0, 0, 0}, frame.up, 0.0, true, loose});
  return wanted;
}

void FaceContacts::mend(std::size_t i, std::vector<Eigen::Vector3d>& state,
                        const std::vector<Eigen::Vector3d>& template_state) const {
  const Sides& sides = sides_[i];
  const std::vector<Watched> watched = before_back(sides, template_state);
  const bool shut = shuts(sides, template_state);
  for (int round = 0; round < most_rounds; ++round) {
    const std::vector<MotionCondition> wanted = conditions(sides, watched, state, shut);
    const bool done = std::all_of(wanted.begin(), wanted.end(), [](const MotionCondition& c) {
      return (c.exact ? std::abs(c.amount) : c.amount) < good_enough;
    });
    if (done) return;
    const std::vector<Eigen::Vector3d> motion = sides.correction->solve(wanted);
    for (std::size_t k = 0; k < motion.size(); ++k) state[sides.correction->movable()[k]] += motion[k];
  }
}

void settle_face(const BodyTemplate& body, std::vector<Eigen::Vector3d>& vertices) {
  const FaceContacts contacts(body, vertices);
  for (std::size_t i = 0; i < contacts.size(); ++i) contacts.mend(i, vertices, body.mesh.vertices);
}

}  // namespace gyre
