// SPDX-License-Identifier: Apache-2.0
#include "offload/body/expression_check.h"

#include "offload/body/humanoid.h"

#include <set>

namespace gyre {
namespace {

constexpr double clear = 2e-4;  // metres that count as a motion

// The motion of a named feature that an expression must have. "*" in names stands for the expression's side.
struct Rule {
  std::string_view expression;  // without its side
  enum Kind : std::uint8_t {
    goes,     // landmark `a` moves along `direction`
    opens,    // landmarks a above b: their distance along y grows (less than 0: shrinks)
    shuts,    // the same shrinks to a third
    narrows,  // both corners of the mouth come nearer to each other
    turns,    // the front of part a moves along `direction`
    mostly    // what moves most goes along `direction`
  } kind;
  std::string_view a, b;
  Eigen::Vector3d direction;  // x: away from the midline for sided expressions, else to the left
};

const std::vector<Rule>& rules() {
  const Eigen::Vector3d up(0, 1, 0), down(0, -1, 0), out(1, 0, 0), in(-1, 0, 0), forward(0, 0, 1), none(0, 0, 0);
  static const std::vector<Rule> list = {{"eyeBlink", Rule::shuts, "*UpperLid", "*LowerLid", none},
                                         {"eyeSquint", Rule::opens, "*UpperLid", "*LowerLid", down},
                                         {"eyeWide", Rule::opens, "*UpperLid", "*LowerLid", up},
                                         {"eyeLookUp", Rule::turns, "*Eye", "", up},
                                         {"eyeLookDown", Rule::turns, "*Eye", "", down},
                                         {"eyeLookIn", Rule::turns, "*Eye", "", in},
                                         {"eyeLookOut", Rule::turns, "*Eye", "", out},
                                         {"jawOpen", Rule::goes, "chin", "", down},
                                         {"jawOpen", Rule::opens, "upperLip", "lowerLip", up},
                                         {"jawForward", Rule::goes, "chin", "", forward},
                                         {"jawLeft", Rule::goes, "chin", "", out},
                                         {"jawRight", Rule::goes, "chin", "", in},
                                         {"mouthClose", Rule::opens, "upperLip", "lowerLip", down},
                                         {"mouthLeft", Rule::goes, "lowerLip", "", out},
                                         {"mouthRight", Rule::goes, "lowerLip", "", in},
                                         {"mouthSmile", Rule::goes, "*MouthCorner", "", up},
                                         {"mouthFrown", Rule::goes, "*MouthCorner", "", down},
                                         {"mouthStretch", Rule::goes, "*MouthCorner", "", out},
                                         {"mouthPucker", Rule::narrows, "", "", none},
                                         {"mouthFunnel", Rule::narrows, "", "", none},
                                         {"mouthShrugLower", Rule::goes, "lowerLip", "", up},
                                         {"mouthShrugUpper", Rule::goes, "upperLip", "", up},
                                         {"mouthUpperUp", Rule::mostly, "", "", up},
                                         {"mouthLowerDown", Rule::mostly, "", "", down},
                                         {"browDown", Rule::mostly, "", "", down},
                                         {"browInnerUp", Rule::mostly, "", "", up},
                                         {"browOuterUp", Rule::mostly, "", "", up},
                                         {"cheekSquint", Rule::mostly, "", "", up},
                                         {"noseSneer", Rule::mostly, "", "", up},
                                         {"tongueOut", Rule::turns, "tongue", "", forward},
                                         {"viseme_aa", Rule::opens, "upperLip", "lowerLip", up},
                                         {"viseme_O", Rule::narrows, "", "", none},
                                         {"viseme_U", Rule::narrows, "", "", none}};
  return list;
}

class ExpressionChecker {
 public:
  explicit ExpressionChecker(const BodyTemplate& body) : body_(body) {}

  std::vector<std::string> run() {
    std::set<std::string, std::less<>> names, known;
    for (const std::string_view name : arkit_expressions()) known.emplace(name);
    for (const std::string_view name : oculus_visemes()) known.emplace(name);
    for (const Morph& morph : body_.expressions) {
      if (!names.insert(morph.name).second) faults_.push_back(morph.name + " is there twice");
      if (!known.count(morph.name)) faults_.push_back("unknown expression " + morph.name);
      check(morph);
    }
    for (const std::string& name : known)
      if (!names.count(name)) faults_.push_back("no expression " + name);
    return faults_;
  }

 private:
  void check(const Morph& morph) {
    offsets_.assign(body_.mesh.vertices.size(), Eigen::Vector3d::Zero());
    double left = 0, right = 0;
    for (std::size_t i = 0; i < morph.vertices.size(); ++i) {
      offsets_[morph.vertices[i]] = morph.offsets[i].cast<double>();
      (body_.mesh.vertices[morph.vertices[i]].x() > 0 ? left : right) += morph.offsets[i].norm();
    }
    if (left + right <= 0) {
      if (morph.name != "viseme_sil") faults_.push_back(morph.name + " moves nothing");  // silence is the face at rest
      return;
    }
    const bool is_direction = morph.name.starts_with("jaw") || morph.name == "mouthLeft" || morph.name == "mouthRight";
    const bool on_left = !is_direction && morph.name.ends_with("Left"),
               on_right = !is_direction && morph.name.ends_with("Right");
    if ((on_left && left <= right) || (on_right && right <= left))
      faults_.push_back(morph.name + " moves the other side");
    std::string bare = morph.name;
    if (on_left) bare.resize(bare.size() - 4);
    if (on_right) bare.resize(bare.size() - 5);
    for (const Rule& rule : rules())
      if (rule.expression == bare) judge(morph, rule, on_left ? "left" : on_right ? "right" : "");
  }

  void judge(const Morph& morph, const Rule& rule, const std::string& side) {
    const auto named = [&](std::string_view name) {
      return name.starts_with("*") ? side + std::string(name.substr(1)) : std::string(name);
    };
    Eigen::Vector3d direction = rule.direction;
    if (side == "right") direction.x() *= -1;
    switch (rule.kind) {
      case Rule::goes:
        if (const int a = landmark(named(rule.a)); a >= 0 && offsets_[a].dot(direction) < clear)
          faults_.push_back(morph.name + " does not move " + named(rule.a) + " the right way");
        break;
      case Rule::opens:
      case Rule::shuts: {
        const int a = landmark(named(rule.a)), b = landmark(named(rule.b));
        if (a < 0 || b < 0) break;
        const double gap = body_.mesh.vertices[a].y() - body_.mesh.vertices[b].y();
        const double growth = offsets_[a].y() - offsets_[b].y();
        const bool good = rule.kind == Rule::shuts ? gap + growth < gap / 3 : growth * direction.y() > clear;
        if (!good)
          faults_.push_back(morph.name + " changes the distance from " + named(rule.a) + " to " + named(rule.b) +
                            " by " + std::to_string(1000 * growth) + " mm of " + std::to_string(1000 * gap));
        break;
      }
      case Rule::narrows: {
        const int a = landmark("leftMouthCorner"), b = landmark("rightMouthCorner");
        if (a >= 0 && b >= 0 && offsets_[b].x() - offsets_[a].x() < clear)
          faults_.push_back(morph.name + " does not narrow the mouth");
        break;
      }
      case Rule::turns:
        if (const TemplatePart* part = body_.part(named(rule.a)); part && front_motion(*part).dot(direction) < clear)
          faults_.push_back(morph.name + " does not move " + named(rule.a) + " the right way");
        break;
      case Rule::mostly:
        if (main_motion(morph).dot(direction) < clear) faults_.push_back(morph.name + " moves the wrong way");
        break;
    }
  }

  int landmark(const std::string& name) const {
    const auto found = body_.landmarks.find(name);
    return found == body_.landmarks.end() ? -1 : found->second;
  }

  Eigen::Vector3d front_motion(const TemplatePart& part) const {
    int front = part.first_vertex;
    for (int v = part.first_vertex; v < part.first_vertex + part.vertex_count; ++v)
      if (body_.mesh.vertices[v].z() > body_.mesh.vertices[front].z()) front = v;
    return offsets_[front];
  }

  // Mean of the offsets longer than half the longest.
  static Eigen::Vector3d main_motion(const Morph& morph) {
    float longest = 0;
    for (const auto& offset : morph.offsets) longest = std::max(longest, offset.norm());
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int count = 0;
    for (const auto& offset : morph.offsets) {
      if (offset.norm() < 0.5F * longest) continue;
      sum += offset.cast<double>();
      ++count;
    }
    return sum / std::max(count, 1);
  }

  const BodyTemplate& body_;
  std::vector<Eigen::Vector3d> offsets_;  // of the expression at hand
  std::vector<std::string> faults_;
};

}  // namespace

std::vector<std::string> expression_faults(const BodyTemplate& body) {
  return ExpressionChecker(body).run();
}

}  // namespace gyre
