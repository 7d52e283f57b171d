// SPDX-License-Identifier: Apache-2.0
#include "offload/fit/person_measures.h"

#include "offload/body/body_measures.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace gyre {

namespace {

class Tailor {
 public:
  Tailor(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest, const std::vector<double>& support,
         double surface, double scale)
      : body_(body), rest_(rest), support_(support), surface_(surface), scale_(scale) {
    const TemplatePart* part = body.part("body");
    const int count = part ? part->triangle_count : static_cast<int>(body.mesh.triangles.size());
    for (int t = 0; t < count; ++t) {
      const Eigen::Vector3i& c = body.mesh.triangles[t];
      if (on_trunk(c[0]) && on_trunk(c[1]) && on_trunk(c[2])) trunk_.push_back(c);
    }
  }

  std::optional<Eigen::Vector3d> landmark(const std::string& name) const {
    const auto found = body_.landmarks.find(name);
    if (found == body_.landmarks.end()) return std::nullopt;
    return rest_[found->second];
  }

  // Share of the vertices for which `of` holds that the cloud shows; 0 when there is none.
  template <class F>
  double support_where(const F& of) const {
    double sum = 0.0;
    int count = 0;
    for (std::size_t v = 0; v < rest_.size(); ++v) {
      if (body_.regions[v] == BodyRegion::inner || !of(static_cast<int>(v))) continue;
      constexpr double shown = 0.1;
      sum += support_[v] > shown ? 1.0 : 0.0;
      ++count;
    }
    return count > 0 ? sum / count : 0.0;
  }

  // `ends`: how many surface points' errors the measure has. `spread`: relative deviation of people from the template's
  // mean, for what is not seen.
  Measure measure(double value, double support, double ends, double spread) const {
    const double unseen = (1.0 - support) * spread * value;
    const double of_scale = scale_ * value;
    return {value, std::sqrt(ends * surface_ * surface_ + of_scale * of_scale + unseen * unseen), support};
  }

  Measure tape(double level, double spread) const {
    const double support = support_where([&](int v) { return on_trunk(v) && std::abs(rest_[v].y() - level) < 0.03; });
    // The radius errs by the surface's; the girth by 2 pi times that, if it erred alike all around.
    constexpr double ends = 4.0 * 3.14159265 * 3.14159265;
    return measure(girth(rest_, trunk_, level), support, ends, spread);
  }

  // The level of the largest girth between two.
  double widest(double low, double high) const {
    double level = low, most = 0.0;
    constexpr double pace = 0.01;  // metres
    for (double y = low; y <= high; y += pace)
      if (const double g = girth(rest_, trunk_, y); g > most) {
        most = g;
        level = y;
      }
    return level;
  }

 private:
  // Not the arms, which hang beside it.
  bool on_trunk(int v) const {
    const BodyRegion r = body_.regions[v];
    return r == BodyRegion::torso || r == BodyRegion::left_leg || r == BodyRegion::right_leg;
  }

  const BodyTemplate& body_;
  const std::vector<Eigen::Vector3d>& rest_;
  const std::vector<double>& support_;
  double surface_, scale_;
  std::vector<Eigen::Vector3i> trunk_;
};

}  // namespace

std::map<std::string, Measure> measure_person(const BodyTemplate& body, const std::vector<Eigen::Vector3d>& rest,
                                              const std::vector<double>& support, double surface, double scale,
                                              double stature, double hair) {
  // Relative deviations of adults about the mean of their stature group, rounded from ANSUR II.
  constexpr double of_stature = 0.04, of_girth = 0.1, of_limb = 0.06;
  const Tailor tailor(body, rest, support, surface, scale);
  std::map<std::string, Measure> measures;
  const auto in = [&](BodyRegion a, BodyRegion b) {
    return tailor.support_where([&](int v) { return body.regions[v] == a || body.regions[v] == b; });
  };
  const double feet = in(BodyRegion::left_foot, BodyRegion::right_foot);
  const double legs = in(BodyRegion::left_leg, BodyRegion::right_leg);

  double top = 0.0;
  for (std::size_t v = 0; v < rest.size(); ++v)
    if (body.regions[v] != BodyRegion::inner) top = std::max(top, rest[v].y());
  // Seen when both ends are: the sole itself never is, the feet around it are.
  const double top_seen = tailor.support_where([&](int v) { return rest[v].y() > top - 0.05; });
  const double feet_seen = std::min(1.0, 2.0 * feet);
  measures["stature"] = tailor.measure(stature, std::min(top_seen, feet_seen), 2.0, of_stature);
  if (hair >= 0) {
    constexpr double of_skull = 0.006;  // metres, of the height of skulls above faces
    Measure m =
        tailor.measure(stature - hair, std::min(in(BodyRegion::face, BodyRegion::face), feet_seen), 2.0, of_stature);
    m.deviation = std::hypot(m.deviation, of_skull);
    measures["stature_without_hair"] = m;
  }
  const auto nipple = tailor.landmark("leftNipple"), navel = tailor.landmark("navel"),
             crotch = tailor.landmark("crotch");
  if (nipple) measures["chest"] = tailor.tape(nipple->y(), of_girth);
  if (navel) measures["waist"] = tailor.tape(navel->y(), of_girth);
  if (navel && crotch && navel->y() > crotch->y())
    measures["hip"] = tailor.tape(tailor.widest(crotch->y() + 0.02, navel->y()), of_girth);
  if (crotch) {
    // Between clothed legs the cloud ends where the cloth does.
    constexpr double of_crotch = 0.012;  // metres
    Measure m = tailor.measure(crotch->y(), std::min(legs, feet_seen), 2.0, of_limb);
    m.deviation = std::hypot(m.deviation, of_crotch);
    measures["inseam"] = m;
  }
  for (const std::string side : {"left", "right"}) {
    const auto shoulder = tailor.landmark(side + "Shoulder"), elbow = tailor.landmark(side + "Elbow"),
               wrist = tailor.landmark(side + "Wrist");
    if (!shoulder || !elbow || !wrist) continue;
    const BodyRegion arm = side == "left" ? BodyRegion::left_arm : BodyRegion::right_arm;
    constexpr double of_landmarks = 0.01;  // metres; sleeves hide them
    Measure m = tailor.measure((*shoulder - *elbow).norm() + (*elbow - *wrist).norm(), in(arm, arm), 2.0, of_limb);
    m.deviation = std::hypot(m.deviation, of_landmarks);
    measures[side + "_arm"] = m;
  }
  return measures;
}

}  // namespace gyre
