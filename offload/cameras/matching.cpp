// SPDX-License-Identifier: Apache-2.0
#include "offload/cameras/matching.h"

#include <limits>

// GCC compiles the kernel for AVX2 as well and picks at load time. Sanitizers cannot run the picking code.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define GYRE_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define GYRE_VECTOR_CLONES
#endif

namespace gyre {

namespace {

// Rows of a at a time, so that the 64 kB of 256 rows of b stay in the cache nearest to the core.
constexpr std::size_t rows_at_once = 4;
constexpr std::size_t columns_at_once = 256;

// Dot products of four descriptors with `count` others; out[4 * column + row].
GYRE_VECTOR_CLONES
void dot_products(const std::int16_t* a0, const std::int16_t* a1, const std::int16_t* a2, const std::int16_t* a3,
                  const std::int16_t* b, std::size_t count, std::int32_t* out) {
  for (std::size_t column = 0; column < count; ++column, b += 128, out += 4) {
    std::int32_t s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    for (int i = 0; i < 128; ++i) {
      s0 += a0[i] * b[i];
      s1 += a1[i] * b[i];
      s2 += a2[i] * b[i];
      s3 += a3[i] * b[i];
    }
    out[0] = s0;
    out[1] = s1;
    out[2] = s2;
    out[3] = s3;
  }
}

struct BestTwo {
  std::int32_t best = std::numeric_limits<std::int32_t>::min();  // largest dot product
  std::int32_t second = std::numeric_limits<std::int32_t>::min();
  int index = -1;

  void offer(std::int32_t dot, int candidate) {
    if (dot > best) {
      second = best;
      best = dot;
      index = candidate;
    } else if (dot > second) {
      second = dot;
    }
  }
};

double squared_distance(std::int32_t dot) {
  constexpr double norm2 = static_cast<double>(descriptor_norm) * descriptor_norm;
  return std::max(0.0, 2.0 - 2.0 * dot / norm2);
}

bool is_distinct(const BestTwo& nearest, const MatchOptions& options) {
  const double best = squared_distance(nearest.best);
  if (best > options.max_distance * options.max_distance) return false;
  if (nearest.second == std::numeric_limits<std::int32_t>::min()) return true;
  return best < options.max_ratio * options.max_ratio * squared_distance(nearest.second);
}

}  // namespace

std::vector<Match> match_descriptors(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                     const MatchOptions& options) {
  if (a.empty() || b.empty()) return {};
  std::vector<BestTwo> in_b(a.size()), in_a(b.size());
  std::array<std::int32_t, rows_at_once * columns_at_once> dots;
  for (std::size_t column = 0; column < b.size(); column += columns_at_once) {
    const std::size_t columns = std::min(columns_at_once, b.size() - column);
    for (std::size_t row = 0; row < a.size(); row += rows_at_once) {
      const std::size_t rows = std::min(rows_at_once, a.size() - row);
      const auto row_data = [&](std::size_t i) { return a[row + std::min(i, rows - 1)].data(); };
      dot_products(row_data(0), row_data(1), row_data(2), row_data(3), b[column].data(), columns, dots.data());
      for (std::size_t i = 0; i < rows; ++i) {
        BestTwo nearest = in_b[row + i];
        for (std::size_t j = 0; j < columns; ++j) {
          const std::int32_t dot = dots[rows_at_once * j + i];
          nearest.offer(dot, static_cast<int>(column + j));
          in_a[column + j].offer(dot, static_cast<int>(row + i));
        }
        in_b[row + i] = nearest;
      }
    }
  }
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const int j = in_b[i].index;
    if (in_a[static_cast<std::size_t>(j)].index != static_cast<int>(i)) continue;
    if (is_distinct(in_b[i], options) && is_distinct(in_a[static_cast<std::size_t>(j)], options))
      matches.push_back({static_cast<int>(i), j});
  }
  return matches;
}

std::vector<Match> match_features(const Features& a, const Features& b, const MatchOptions& options) {
  std::vector<Match> matches;
  std::vector<bool> used_a(a.keypoints.size()), used_b(b.keypoints.size());
  for (const Match& match : match_descriptors(a.descriptors, b.descriptors, options)) {
    const int place_a = a.keypoint_of[static_cast<std::size_t>(match.a)];
    const int place_b = b.keypoint_of[static_cast<std::size_t>(match.b)];
    if (used_a[static_cast<std::size_t>(place_a)] || used_b[static_cast<std::size_t>(place_b)]) continue;
    used_a[static_cast<std::size_t>(place_a)] = true;
    used_b[static_cast<std::size_t>(place_b)] = true;
    matches.push_back({place_a, place_b});
  }
  std::sort(matches.begin(), matches.end());
  return matches;
}

}  // namespace gyre
