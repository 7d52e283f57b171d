// SPDX-License-Identifier: Apache-2.0
#include "offload/body/built_in_cage.h"

#include "offload/body/humanoid.h"
#include "offload/body/template_tools.h"

#include <initializer_list>
#include <numbers>

namespace gyre {
namespace {

struct Bone {
  std::string_view name;
  double weight;
};
using Bones = std::initializer_list<Bone>;

struct ChartFace {
  std::vector<int> corners;
  std::vector<Eigen::Vector2d> uv;  // metres on the chart
  int chart;
};

// A rectangle of the atlas that one swept part is unrolled into.
struct Chart {
  double width = 0, height = 0;  // metres
  double density = 1;            // relative texel density
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
};

// Four points a ring from the front of the midline to its back: the half of a torso or head section.
struct HalfSection {
  double y, front_z, side_x, front_side_z, back_side_z, back_z;
};

// The left half of the cage: sections of the trunk, swept limbs, and their charts.
class HalfHuman {
 public:
  std::vector<CagePoint> points;
  std::vector<ChartFace> faces;
  std::vector<Chart> charts;
  std::map<std::string, std::vector<int>> rings;  // by what a joint or landmark calls them

  HalfHuman() {
    trunk();
    arm();
    leg();
  }

 private:
  using Ring = std::vector<int>;

  int point(const Eigen::Vector3d& position, const Eigen::Vector3d& centre, Bones bones, BodyRegion region) {
    CagePoint p{position, centre, {}, region};
    for (const Bone& bone : bones) p.bones[humanoid_bone(bone.name)] += bone.weight;
    points.push_back(std::move(p));
    return static_cast<int>(points.size()) - 1;
  }

  Ring half_section(const std::string& name, const HalfSection& s, Bones middle, Bones side, BodyRegion region) {
    const Eigen::Vector3d centre(0, s.y, 0.5 * (s.front_z + s.back_z));
    Ring ring = {point({0, s.y, s.front_z}, centre, middle, region),
                 point({s.side_x, s.y, s.front_side_z}, centre, side, region),
                 point({s.side_x, s.y, s.back_side_z}, centre, side, region),
                 point({0, s.y, s.back_z}, centre, middle, region)};
    return rings[name] = ring;
  }

  // Corners centre -a-b, -a+b... in the order (-up, +across), (-up, -across), (+up, -across), (+up, +across).
  Ring box(const std::string& name, const Eigen::Vector3d& centre, const Eigen::Vector3d& up,
           const Eigen::Vector3d& across, Bones bones, BodyRegion region) {
    Ring ring = {point(centre - up + across, centre, bones, region), point(centre - up - across, centre, bones, region),
                 point(centre + up - across, centre, bones, region),
                 point(centre + up + across, centre, bones, region)};
    return rings[name] = ring;
  }

  int chart(double density) {
    charts.emplace_back();
    charts.back().density = density;
    return static_cast<int>(charts.size()) - 1;
  }

  // Quads between two rings, unrolled below what the chart holds. skip: a column left open for a branch.
  void sweep(int on, const Ring& from, const Ring& to, bool closed, int skip = -1) {
    const int columns = static_cast<int>(from.size()) - (closed ? 0 : 1);
    const double length = (mean(to) - mean(from)).norm();
    double around = 0;
    for (int i = 0; i < columns; ++i) around += distance(to[i], to[(i + 1) % to.size()]);
    Chart& c = charts[on];
    c.width = std::max(c.width, around);
    for (int i = 0; i < columns; ++i) {
      const int j = (i + 1) % static_cast<int>(from.size());
      if (i == skip) continue;
      // u in columns; scaled to metres when the chart's width is known.
      faces.push_back({{from[i], from[j], to[j], to[i]},
                       {{i / double(columns), c.height},
                        {(i + 1) / double(columns), c.height},
                        {(i + 1) / double(columns), c.height + length},
                        {i / double(columns), c.height + length}},
                       on});
    }
    c.height += length;
  }

  // Closes a swept limb with one face, put below its first column.
  void cap(int on, const Ring& ring, double columns) {
    Chart& c = charts[on];
    const double side = c.width / columns;
    std::vector<Eigen::Vector2d> uv = {{0, c.height}, {1 / columns, c.height}};
    uv.emplace_back(1 / columns, c.height + side);
    uv.emplace_back(0, c.height + side);
    faces.push_back({ring, uv, on});
    c.height += side;
  }

  // A flat many-sided face on a chart of its own, seen along `normal`.
  void flat(const Ring& corners, const Eigen::Vector3d& normal, double density) {
    const int on = chart(density);
    const Eigen::Vector3d u = (points[corners[1]].position - points[corners[0]].position).normalized();
    const Eigen::Vector3d v = normal.cross(u).normalized();
    Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    std::vector<Eigen::Vector2d> uv;
    for (int corner : corners) {
      uv.emplace_back(u.dot(points[corner].position), v.dot(points[corner].position));
      low = low.cwiseMin(uv.back());
      high = high.cwiseMax(uv.back());
    }
    charts[on].width = high.x() - low.x();
    charts[on].height = high.y() - low.y();
    for (auto& at : uv) at = Eigen::Vector2d((at.x() - low.x()) / charts[on].width, at.y() - low.y());
    faces.push_back({corners, uv, on});
  }

  Eigen::Vector3d mean(const Ring& ring) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int p : ring) sum += points[p].position;
    return sum / static_cast<double>(ring.size());
  }
  double distance(int a, int b) const { return (points[a].position - points[b].position).norm(); }

  void trunk();
  void arm();
  void leg();
  void hand(const Eigen::Vector3d& along, const Eigen::Vector3d& up, const Eigen::Vector3d& wrist, int on,
            const Ring& wrist_ring);
};

void HalfHuman::trunk() {
  using enum BodyRegion;
  const Ring crotch = half_section("crotch", {0.79, 0.055, 0.165, 0.055, -0.075, -0.075}, {{"hips", 1}},
                                   {{"hips", 0.5}, {"leftUpperLeg", 0.5}}, torso);
  const Ring hips = half_section("hips", {0.89, 0.105, 0.165, 0.06, -0.085, -0.105}, {{"hips", 1}},
                                 {{"hips", 0.9}, {"leftUpperLeg", 0.1}}, torso);
  const Ring loin = half_section("loin", {0.98, 0.105, 0.145, 0.06, -0.07, -0.085}, {{"hips", 0.6}, {"spine", 0.4}},
                                 {{"hips", 0.6}, {"spine", 0.4}}, torso);
  const Ring waist =
      half_section("waist", {1.06, 0.1, 0.128, 0.055, -0.06, -0.075}, {{"spine", 1}}, {{"spine", 1}}, torso);
  const Ring ribs = half_section("ribs", {1.17, 0.11, 0.138, 0.065, -0.065, -0.09}, {{"spine", 0.5}, {"chest", 0.5}},
                                 {{"spine", 0.5}, {"chest", 0.5}}, torso);
  const Ring armpit = half_section("armpit", {1.275, 0.115, 0.15, 0.06, -0.075, -0.1},
                                   {{"chest", 0.4}, {"upperChest", 0.6}}, {{"chest", 0.4}, {"upperChest", 0.6}}, torso);
  const Ring shoulder = half_section("shoulder", {1.375, 0.085, 0.15, 0.035, -0.07, -0.09}, {{"upperChest", 1}},
                                     {{"upperChest", 0.3}, {"leftShoulder", 0.5}, {"leftUpperArm", 0.2}}, torso);
  const Ring collar = half_section("collar", {1.425, 0.045, 0.06, 0.025, -0.055, -0.075},
                                   {{"upperChest", 0.6}, {"neck", 0.4}}, {{"upperChest", 0.6}, {"neck", 0.4}}, torso);
  const Ring neck = half_section("neck", {1.465, 0.045, 0.05, 0.025, -0.05, -0.07}, {{"neck", 0.8}, {"head", 0.2}},
                                 {{"neck", 0.8}, {"head", 0.2}}, head);
  const Ring chin =
      half_section("chin", {1.485, 0.098, 0.056, 0.03, -0.05, -0.078}, {{"head", 1}}, {{"head", 1}}, head);
  const Ring mouth =
      half_section("mouth", {1.52, 0.105, 0.062, 0.05, -0.055, -0.088}, {{"head", 1}}, {{"head", 1}}, head);
  const Ring nose =
      half_section("nose", {1.552, 0.122, 0.068, 0.055, -0.06, -0.095}, {{"head", 1}}, {{"head", 1}}, head);
  const Ring eyes = half_section("eyes", {1.59, 0.1, 0.07, 0.062, -0.062, -0.1}, {{"head", 1}}, {{"head", 1}}, head);
  const Ring brow = half_section("brow", {1.62, 0.1, 0.071, 0.06, -0.062, -0.1}, {{"head", 1}}, {{"head", 1}}, head);
  const Ring forehead =
      half_section("forehead", {1.665, 0.085, 0.06, 0.045, -0.055, -0.085}, {{"head", 1}}, {{"head", 1}}, head);
  const Ring crown =
      half_section("crown", {1.694, 0.035, 0.028, 0.015, -0.03, -0.04}, {{"head", 1}}, {{"head", 1}}, head);
  for (const Ring* front : {&chin, &mouth, &nose, &eyes, &brow})
    for (int i : {0, 1}) points[(*front)[i]].region = face;
  for (int i : {0, 1}) points[chin[i]].bones = {{humanoid_bone("head"), 0.4}, {humanoid_bone("jaw"), 0.6}};

  const int body = chart(1);
  for (const auto& [from, to] : {std::pair{crotch, hips}, {hips, loin}, {loin, waist}, {waist, ribs}, {ribs, armpit}})
    sweep(body, from, to, false);
  sweep(body, armpit, shoulder, false, 1);  // column 1 is the arm's
  sweep(body, shoulder, collar, false);
  const int top = chart(1.8);
  for (const auto& [from, to] : {std::pair{collar, neck},
                                 {neck, chin},
                                 {chin, mouth},
                                 {mouth, nose},
                                 {nose, eyes},
                                 {eyes, brow},
                                 {brow, forehead},
                                 {forehead, crown}})
    sweep(top, from, to, false);
  cap(top, crown, 3);
}

void HalfHuman::arm() {
  using enum BodyRegion;
  const double down = std::numbers::pi / 4;
  const Eigen::Vector3d along(std::cos(down), -std::sin(down), 0), up(std::sin(down), std::cos(down), 0);
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ(), start(0.172, 1.338, -0.02);
  const int on = chart(1);
  Ring last = {rings["armpit"][1], rings["armpit"][2], rings["shoulder"][2], rings["shoulder"][1]};
  const auto next = [&](const std::string& name, double at, double thick, double wide, Bones bones) {
    const Ring ring = box(name, start + at * along, thick * up, wide * across, bones, left_arm);
    sweep(on, last, ring, true);
    last = ring;
  };
  next("upperArm", 0.02, 0.042, 0.045, {{"leftShoulder", 0.3}, {"leftUpperArm", 0.7}});
  next("deltoid", 0.09, 0.036, 0.038, {{"leftUpperArm", 1}});
  next("biceps", 0.18, 0.032, 0.033, {{"leftUpperArm", 1}});
  next("aboveElbow", 0.245, 0.028, 0.029, {{"leftUpperArm", 0.85}, {"leftLowerArm", 0.15}});
  next("elbow", 0.28, 0.027, 0.028, {{"leftUpperArm", 0.5}, {"leftLowerArm", 0.5}});
  next("belowElbow", 0.315, 0.028, 0.03, {{"leftUpperArm", 0.1}, {"leftLowerArm", 0.9}});
  next("forearm", 0.4, 0.025, 0.027, {{"leftLowerArm", 1}});
  next("aboveWrist", 0.49, 0.018, 0.022, {{"leftLowerArm", 0.9}, {"leftHand", 0.1}});
  next("wrist", 0.53, 0.016, 0.022, {{"leftLowerArm", 0.5}, {"leftHand", 0.5}});
  hand(along, up, start + 0.53 * along, on, last);
}

void HalfHuman::hand(const Eigen::Vector3d& along, const Eigen::Vector3d& up, const Eigen::Vector3d& wrist, int on,
                     const Ring& wrist_ring) {
  using enum BodyRegion;
  const Eigen::Vector3d across = Eigen::Vector3d::UnitZ();
  const Ring palm = box("palm", wrist + 0.045 * along, 0.013 * up, 0.034 * across, {{"leftHand", 1}}, left_hand);
  sweep(on, wrist_ring, palm, true, 3);  // column 3, the front, is the thumb's

  // Five pairs of knuckle points between and beside the fingers, from the index finger's side to the little one's.
  const std::array<double, 5> knuckle_z = {0.037, 0.019, 0.0, -0.019, -0.036};
  const std::array<double, 5> knuckle_at = {0.088, 0.095, 0.095, 0.09, 0.08};
  Ring lower, upper;
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector3d centre = wrist + knuckle_at[i] * along;
    const Eigen::Vector3d at = centre + knuckle_z[i] * across;
    lower.push_back(point(at - 0.010 * up, centre, {{"leftHand", 1}}, left_hand));
    upper.push_back(point(at + 0.010 * up, centre, {{"leftHand", 1}}, left_hand));
  }
  flat({palm[0], palm[1], lower[4], lower[3], lower[2], lower[1], lower[0]}, -up, 1.4);
  flat({palm[2], palm[3], upper[0], upper[1], upper[2], upper[3], upper[4]}, up, 1.4);
  flat({palm[1], palm[2], upper[4], lower[4]}, -across, 1.4);
  flat({palm[3], palm[0], lower[0], upper[0]}, across, 1.4);

  const auto digit = [&](const std::string& finger, const Ring& root, const Eigen::Vector3d& towards, double radius,
                         const std::array<double, 3>& lengths, const std::array<std::string, 3>& bones) {
    const int unrolled = chart(1.4);
    const Eigen::Vector3d beside = up.cross(towards).normalized() * -radius;
    Eigen::Vector3d centre = mean(root);
    Ring from = root;
    rings[finger + "0"] = root;
    for (int phalanx = 0; phalanx < 3; ++phalanx) {
      centre += lengths[phalanx] * towards;
      const double taper = 1 - 0.1 * phalanx;
      const std::string mine = "left" + finger + bones[phalanx];
      const std::string after = "left" + finger + bones[std::min(phalanx + 1, 2)];
      const Ring ring = box(finger + std::to_string(phalanx + 1), centre, taper * 0.9 * radius * up, taper * beside,
                            {{mine, 0.5}, {after, 0.5}}, left_hand);
      sweep(unrolled, from, ring, true);
      from = ring;
    }
    cap(unrolled, from, 4);
    for (int corner : root) {
      points[corner].bones[humanoid_bone("left" + finger + bones[0])] += 0.5;
    }
  };
  const std::array<std::string, 3> phalanges = {"Proximal", "Intermediate", "Distal"};
  const std::array<std::pair<const char*, double>, 4> fingers = {
      {{"Index", 0.072}, {"Middle", 0.08}, {"Ring", 0.074}, {"Little", 0.058}}};
  for (int i = 0; i < 4; ++i) {
    const double length = fingers[i].second;
    digit(fingers[i].first, {lower[i], lower[i + 1], upper[i + 1], upper[i]}, along, 0.0068,
          {0.48 * length, 0.28 * length, 0.24 * length}, phalanges);
  }
  digit("Thumb", {wrist_ring[3], wrist_ring[0], palm[0], palm[3]}, (0.75 * along + 0.66 * across).normalized(), 0.0085,
        {0.042, 0.03, 0.025}, {"Metacarpal", "Proximal", "Distal"});
}

void HalfHuman::leg() {
  using enum BodyRegion;
  const int on = chart(1);
  const Ring crotch = rings["crotch"];
  Ring last = {crotch[1], crotch[0], crotch[3], crotch[2]};
  // Corners as the crotch's: front outside, front inside, back inside, back outside.
  const auto section = [&](const std::string& name, double y, double x, double wide, double front, double back,
                           Bones bones, BodyRegion region) {
    const Eigen::Vector3d centre(x, y, 0.5 * (front + back));
    return rings[name] = {
               point({x + wide, y, front}, centre, bones, region), point({x - wide, y, front}, centre, bones, region),
               point({x - wide, y, back}, centre, bones, region), point({x + wide, y, back}, centre, bones, region)};
  };
  const auto next = [&](const std::string& name, double y, double x, double wide, double front, double back,
                        Bones bones) {
    const Ring ring = section(name, y, x, wide, front, back, bones, left_leg);
    sweep(on, last, ring, true);
    last = ring;
  };
  next("thigh", 0.71, 0.09, 0.056, 0.062, -0.066, {{"leftUpperLeg", 1}});
  next("midThigh", 0.6, 0.092, 0.05, 0.058, -0.054, {{"leftUpperLeg", 1}});
  next("aboveKnee", 0.51, 0.092, 0.041, 0.048, -0.04, {{"leftUpperLeg", 0.9}, {"leftLowerLeg", 0.1}});
  next("knee", 0.46, 0.092, 0.037, 0.045, -0.036, {{"leftUpperLeg", 0.5}, {"leftLowerLeg", 0.5}});
  next("belowKnee", 0.41, 0.092, 0.035, 0.036, -0.042, {{"leftUpperLeg", 0.1}, {"leftLowerLeg", 0.9}});
  next("calf", 0.31, 0.092, 0.036, 0.025, -0.055, {{"leftLowerLeg", 1}});
  next("shin", 0.19, 0.092, 0.026, 0.015, -0.043, {{"leftLowerLeg", 1}});
  next("ankle", 0.085, 0.092, 0.024, 0.02, -0.042, {{"leftLowerLeg", 0.5}, {"leftFoot", 0.5}});
  for (int p : last) points[p].region = left_foot;

  const Ring ankle = last;
  const Ring sole = section("sole", 0, 0.092, 0.026, 0.03, -0.06, {{"leftFoot", 1}}, left_foot);
  sweep(on, ankle, sole, true, 0);  // column 0, the front, is the foot's
  cap(on, sole, 4);
  const int foot = chart(1);
  last = {ankle[0], ankle[1], sole[1], sole[0]};
  const auto forward = [&](const std::string& name, double z, double x, double wide, double top, Bones bones) {
    const Eigen::Vector3d centre(x, 0.5 * top, z);
    const Ring ring = {
        point({x + wide, top, z}, centre, bones, left_foot), point({x - wide, top, z}, centre, bones, left_foot),
        point({x - wide, 0, z}, centre, bones, left_foot), point({x + wide, 0, z}, centre, bones, left_foot)};
    sweep(foot, last, ring, true);
    last = rings[name] = ring;
  };
  forward("instep", 0.075, 0.094, 0.032, 0.058, {{"leftFoot", 1}});
  forward("ball", 0.13, 0.098, 0.04, 0.036, {{"leftFoot", 0.5}, {"leftToes", 0.5}});
  forward("toes", 0.178, 0.1, 0.033, 0.022, {{"leftToes", 1}});
  cap(foot, last, 4);
}

// Puts the charts into [0, 0.5] x [0, 1] in shelves, as large as they fit.
void pack(std::vector<Chart>& charts) {
  constexpr double gap = 0.008;
  std::vector<int> order(charts.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return charts[a].height * charts[a].density > charts[b].height * charts[b].density;
  });
  for (double scale = 2;; scale *= 0.98) {
    double x = gap, y = gap, shelf = 0;
    bool fits = true;
    for (int i : order) {
      Chart& c = charts[i];
      const double w = scale * c.density * c.width, h = scale * c.density * c.height;
      if (x + w + gap > 0.5) {
        x = gap;
        y += shelf + gap;
        shelf = 0;
      }
      fits = fits && x + w + gap <= 0.5 && y + h + gap <= 1;
      c.corner = {x, y};
      x += w + gap;
      shelf = std::max(shelf, h);
    }
    if (!fits) continue;
    for (Chart& c : charts) c.density *= scale;
    return;
  }
}

}  // namespace

// Adds the right half: mirrored points off the midline, bones and regions of the other side, charts at 1 - u.
HumanCage human_cage() {
  HalfHuman half;
  pack(half.charts);
  HumanCage cage;
  cage.points = half.points;
  cage.rings = half.rings;
  cage.mirror.resize(half.points.size());
  for (std::size_t i = 0; i < half.points.size(); ++i) {
    if (half.points[i].position.x() == 0) {
      cage.mirror[i] = static_cast<int>(i);
      continue;
    }
    CagePoint p = half.points[i];
    p.position.x() *= -1;
    p.centre.x() *= -1;
    p.bones.clear();
    for (const auto& [bone, weight] : half.points[i].bones)
      p.bones[humanoid_bone(mirrored_name(humanoid_bones()[bone].name))] = weight;
    p.region = mirrored_region(p.region);
    cage.mirror[i] = static_cast<int>(cage.points.size());
    cage.mirror.push_back(static_cast<int>(i));
    cage.points.push_back(std::move(p));
  }
  for (const ChartFace& f : half.faces) {
    const Chart& c = half.charts[f.chart];
    CageFace face{f.corners, {}};
    for (const auto& uv : f.uv) face.uv.push_back(c.corner + c.density * Eigen::Vector2d(uv.x() * c.width, uv.y()));
    CageFace other = face;
    for (int& corner : other.corners) corner = cage.mirror[corner];
    for (auto& uv : other.uv) uv.x() = 1 - uv.x();
    std::reverse(other.corners.begin(), other.corners.end());
    std::reverse(other.uv.begin(), other.uv.end());
    cage.faces.push_back(std::move(face));
    cage.faces.push_back(std::move(other));
  }
  return cage;
}

}  // namespace gyre
