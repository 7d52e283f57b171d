// SPDX-License-Identifier: Apache-2.0
#include "offload/body/body_evaluator.h"

namespace gyre {
namespace {

constexpr std::size_t chunk_vertices = 512, chunk_size = 3 * chunk_vertices;

// sum += amounts[0] rows[0] + ... + amounts[3] rows[3], a chunk each. Inlined, the compiler no longer knows that these
// do not overlap, and works on one number at a time.
[[gnu::noinline]] void add_rows(const std::array<const std::int16_t*, 4>& rows, const float* amounts,
                                float* __restrict sum) {
  const std::int16_t* __restrict a = rows[0], * __restrict b = rows[1], * __restrict c = rows[2], * __restrict d = rows[3];
  const float wa = amounts[0], wb = amounts[1], wc = amounts[2], wd = amounts[3];
  for (std::size_t i = 0; i < chunk_size; ++i)
    sum[i] += (wa * static_cast<float>(a[i]) + wb * static_cast<float>(b[i])) +
              (wc * static_cast<float>(c[i]) + wd * static_cast<float>(d[i]));
}

}  // namespace

BodyEvaluator::BodyEvaluator(const BodyTemplate& body)
    : body_(body),
      mean_(3 * static_cast<Eigen::Index>(body.mesh.vertices.size())),
      shapes_(pack(body.shapes)),
      heads_(pack(body.head_shapes)),
      expressions_(pack(body.expressions)) {
  const auto count = static_cast<Eigen::Index>(body.mesh.vertices.size());
  for (Eigen::Index v = 0; v < count; ++v) mean_.segment<3>(3 * v) = body.mesh.vertices[v].cast<float>();
  for (const SkinWeights& skin : body.skin) {
    Influence influence{};
    for (std::size_t k = 0; k < 4; ++k) {
      influence.joint[k] = static_cast<std::uint16_t>(skin.joint[k]);
      influence.weight[k] = skin.weight[k];
    }
    skin_.push_back(influence);
  }
  rest_.resize(3, count);
  posed_.resize(3, count);
}

BodyEvaluator::Block BodyEvaluator::pack(const std::vector<Morph>& morphs) {
  std::map<int, std::size_t> place;
  for (const Morph& morph : morphs)
    for (int v : morph.vertices) place[v] = 0;
  Block block;
  for (auto& [vertex, at] : place) {
    at = block.vertices.size();
    block.vertices.push_back(vertex);
  }
  const std::size_t chunks = (block.vertices.size() + chunk_vertices - 1) / chunk_vertices;
  block.offsets.assign(chunks * morphs.size() * chunk_size, 0);
  for (std::size_t m = 0; m < morphs.size(); ++m) {
    float largest = 1e-9F;
    for (const auto& offset : morphs[m].offsets) largest = std::max(largest, offset.cwiseAbs().maxCoeff());
    block.step.push_back(largest / 32767);
    for (std::size_t i = 0; i < morphs[m].vertices.size(); ++i) {
      const std::size_t at = place.at(morphs[m].vertices[i]);
      std::int16_t* steps =
          &block.offsets[((at / chunk_vertices) * morphs.size() + m) * chunk_size + 3 * (at % chunk_vertices)];
      for (int axis = 0; axis < 3; ++axis)
        steps[axis] = static_cast<std::int16_t>(std::lround(morphs[m].offsets[i][axis] / block.step.back()));
    }
  }
  return block;
}

void BodyEvaluator::add(const Block& block, const Eigen::VectorXd& weights) {
  std::vector<std::size_t> used;
  std::vector<float> amounts;
  for (std::size_t m = 0; m < std::min(block.step.size(), static_cast<std::size_t>(weights.size())); ++m)
    if (const double weight = weights[static_cast<Eigen::Index>(m)]; weight != 0) {
      used.push_back(m);
      amounts.push_back(static_cast<float>(weight) * block.step[m]);
    }
  if (used.empty()) return;
  // Four at a time, so that a sum is fetched and stored a quarter as often; what is missing to four adds nothing.
  while (used.size() % 4 != 0) {
    used.push_back(used.back());
    amounts.push_back(0);
  }
  std::array<float, chunk_size> sum{};
  for (std::size_t first = 0, chunk = 0; first < block.vertices.size(); first += chunk_vertices, ++chunk) {
    sum.fill(0);
    const std::int16_t* base = &block.offsets[chunk * block.step.size() * chunk_size];
    for (std::size_t u = 0; u < used.size(); u += 4) {
      std::array<const std::int16_t*, 4> rows{};
      for (std::size_t k = 0; k < 4; ++k) rows[k] = base + used[u + k] * chunk_size;
      add_rows(rows, &amounts[u], sum.data());
    }
    const std::size_t count = std::min(chunk_vertices, block.vertices.size() - first);
    for (std::size_t i = 0; i < count; ++i)
      rest_.col(block.vertices[first + i]) += Eigen::Map<const Eigen::Vector3f>(&sum[3 * i]);
  }
}

const Eigen::Matrix3Xf& BodyEvaluator::vertices(const BodyState& state) {
  const auto scale = static_cast<float>(state.scale);
  rest_.reshaped() = mean_;
  add(shapes_, state.shape);
  add(heads_, state.head);
  rest_joints_.assign(body_.joints.size(), Eigen::Vector3d::Zero());
  for (std::size_t j = 0; j < body_.joints.size(); ++j)
    for (const auto& [vertex, weight] : body_.joints[j].regressor)
      rest_joints_[j] += state.scale * weight * rest_.col(vertex).cast<double>();
  add(expressions_, state.expression);
  if (scale != 1) rest_ *= scale;

  posed_from_rest_ = joint_transforms(body_, rest_joints_, state.pose);
  // Columns of four floats, so that blending works on whole registers.
  std::vector<Eigen::Matrix4f, Eigen::aligned_allocator<Eigen::Matrix4f>> transforms;
  for (const Eigen::Affine3d& transform : posed_from_rest_) transforms.emplace_back(transform.matrix().cast<float>());
  for (Eigen::Index v = 0; v < rest_.cols(); ++v) {
    const Influence& skin = skin_[v];
    const Eigen::Vector4f at(rest_(0, v), rest_(1, v), rest_(2, v), 1);
    Eigen::Vector4f sum = skin.weight[0] * (transforms[skin.joint[0]] * at);
    for (std::size_t k = 1; k < 4; ++k)
      if (skin.weight[k] != 0) sum += skin.weight[k] * (transforms[skin.joint[k]] * at);
    posed_.col(v) = sum.head<3>();
  }
  return posed_;
}

}  // namespace gyre
