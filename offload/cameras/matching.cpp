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

// Dot products of four descriptors with `count` others; out[columns_at_once * row + column].
GYRE_VECTOR_CLONES
void dot_products(const std::int16_t* a0, const std::int16_t* a1, const std::int16_t* a2, const std::int16_t* a3,
                  const std::int16_t* b, std::size_t count, std::int32_t* out) {
  for (std::size_t column = 0; column < count; ++column, b += 128, ++out) {
    std::int32_t s0 = 0, s1 = 0, s2 = 0, s3 = 0;
    for (int i = 0; i < 128; ++i) {
      s0 += a0[i] * b[i];
      s1 += a1[i] * b[i];
      s2 += a2[i] * b[i];
      s3 += a3[i] * b[i];
    }
    out[0] = s0;
    out[columns_at_once] = s1;
    out[2 * columns_at_once] = s2;
    out[3 * columns_at_once] = s3;
  }
}

// The two largest dot products of each of several descriptors, in arrays that a vector of them can be read from.
struct BestTwo {
  explicit BestTwo(std::size_t size) : best(size, none), second(size, none), index(size, -1) {}

  void offer(std::size_t of, std::int32_t dot, std::size_t candidate) {
    if (dot > best[of]) {
      second[of] = best[of];
      best[of] = dot;
      index[of] = static_cast<int>(candidate);
    } else if (dot > second[of]) {
      second[of] = dot;
    }
  }

  static constexpr std::int32_t none = std::numeric_limits<std::int32_t>::min();
  std::vector<std::int32_t> best, second;
  std::vector<int> index;
};

constexpr std::size_t looked_at_once = 16;

// Whether any of the dot products beats what its row or its column knows. Not inlined, because unrolled into its caller
// it would be compared one by one.
GYRE_VECTOR_CLONES [[gnu::noinline]] bool any_better(const std::int32_t* dots, std::int32_t second_in_row,
                                                     const std::int32_t* second_in_column) {
  std::int32_t any = 0;
  // Negated, the comparisons are the masks that vector instructions give.
  for (std::size_t k = 0; k < looked_at_once; ++k)
    any |=
        -static_cast<std::int32_t>(dots[k] > second_in_row) | -static_cast<std::int32_t>(dots[k] > second_in_column[k]);
  return any != 0;
}

// Offers the dot products of row `row` with the columns from `column` on, to both.
void offer_row(const std::int32_t* dots, std::size_t columns, std::size_t row, std::size_t column, BestTwo& in_b,
               BestTwo& in_a) {
  for (std::size_t j = 0; j < columns; j += looked_at_once) {
    const std::size_t end = std::min(j + looked_at_once, columns);
    // Soon after the start hardly any is better than what is known.
    if (end - j == looked_at_once && !any_better(dots + j, in_b.second[row], &in_a.second[column + j])) continue;
    for (std::size_t k = j; k < end; ++k) {
      in_b.offer(row, dots[k], column + k);
      in_a.offer(column + k, dots[k], row);
    }
  }
}

double squared_distance(std::int32_t dot) {
  constexpr double norm2 = static_cast<double>(descriptor_norm) * descriptor_norm;
  return std::max(0.0, 2.0 - 2.0 * dot / norm2);
}

bool is_distinct(const BestTwo& nearest, std::size_t of, const MatchOptions& options) {
  const double best = squared_distance(nearest.best[of]);
  if (best > options.max_distance * options.max_distance) return false;
  if (nearest.second[of] == BestTwo::none) return true;
  return best < options.max_ratio * options.max_ratio * squared_distance(nearest.second[of]);
}

}  // namespace

std::vector<Match> match_descriptors(std::span<const Descriptor> a, std::span<const Descriptor> b,
                                     const MatchOptions& options) {
  if (a.empty() || b.empty()) return {};
  BestTwo in_b(a.size()), in_a(b.size());
  std::array<std::int32_t, rows_at_once * columns_at_once> dots;
  for (std::size_t column = 0; column < b.size(); column += columns_at_once) {
    const std::size_t columns = std::min(columns_at_once, b.size() - column);
    for (std::size_t row = 0; row < a.size(); row += rows_at_once) {
      const std::size_t rows = std::min(rows_at_once, a.size() - row);
      const auto row_data = [&](std::size_t i) { return a[row + std::min(i, rows - 1)].data(); };
      dot_products(row_data(0), row_data(1), row_data(2), row_data(3), b[column].data(), columns, dots.data());
      for (std::size_t i = 0; i < rows; ++i)
        offer_row(&dots[columns_at_once * i], columns, row + i, column, in_b, in_a);
    }
  }
  std::vector<Match> matches;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const auto j = static_cast<std::size_t>(in_b.index[i]);
    if (in_a.index[j] != static_cast<int>(i)) continue;
    if (is_distinct(in_b, i, options) && is_distinct(in_a, j, options))
      matches.push_back({static_cast<int>(i), static_cast<int>(j)});
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
