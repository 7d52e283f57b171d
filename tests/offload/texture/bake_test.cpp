// SPDX-License-Identifier: Apache-2.0
#include "offload/texture/bake.h"
#include "offload/texture/atlas.h"
#include "offload/texture/paint.h"
#include "tests/offload/texture/scene.h"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace gyre {
namespace {

const Progress silent = [](double, std::string_view) {};

BakeOptions small_options() {
  BakeOptions options;
  options.size = 256;
  return options;
}

struct Difference {
  double mean = 0, worst = 0;
};

// Between the baked texture and the truth, over texels whose source is a photograph.
Difference difference(const BakedTexture& baked, const cv::Mat& truth, const TriangleMesh& mesh) {
  const Atlas atlas = map_atlas(mesh.uv, mesh.uv_triangles, baked.albedo.rows, 0);
  cv::Mat small;
  cv::resize(truth, small, baked.albedo.size(), 0, 0, cv::INTER_AREA);
  Difference d;
  int count = 0;
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    const int y = static_cast<int>(i) / atlas.size;
    const int x = static_cast<int>(i) % atlas.size;
    const cv::Vec3b source = baked.source.at<cv::Vec3b>(y, x);
    if (atlas.triangle[i] < 0 || source == cv::Vec3b(60, 60, 60)) continue;
    const double off = cv::norm(baked.albedo.at<cv::Vec3b>(y, x), small.at<cv::Vec3b>(y, x), cv::NORM_INF);
    d.mean += off;
    d.worst = std::max(d.worst, off);
    ++count;
  }
  d.mean /= count;
  return d;
}

double share(const BakedTexture& baked, TexelOrigin origin) {
  const double total = static_cast<double>(std::accumulate(baked.origins.begin(), baked.origins.end(), std::size_t{0}));
  return static_cast<double>(baked.origins[static_cast<std::size_t>(origin)]) / total;
}

bool is_magenta(const cv::Vec3b& c) {
  return c[0] > c[1] + 60 && c[2] > c[1] + 60;
}

class PaintedBox : public testing::Test {
 protected:
  PaintedBox() {
    scene::add_box(box_.mesh, {0, 0, 0}, {0.2, 0.3, 0.15}, 10, {0, 0}, 1.0);
    painting_ = scene::painting(box_.mesh, 512);
    photos_ = scene::ring(box_.mesh, painting_, 10, 1.6);
  }

  BakeSubject box_;
  cv::Mat painting_;
  std::vector<Photo> photos_;
};

// Round, so that every two neighbouring photographs see much of the same surface.
class PaintedBall : public testing::Test {
 protected:
  PaintedBall() { scene::add_ball(ball_.mesh, 0.25, 16); }

  BakeSubject ball_;
};

TEST_F(PaintedBox, GetsItsPaintingBack) {
  const auto baked = bake_texture(box_, photos_, small_options(), 2, silent);
  ASSERT_TRUE(baked) << baked.error().message();
  const Difference d = difference(*baked, painting_, box_.mesh);
  EXPECT_LT(d.mean, 1.5);
  EXPECT_LT(d.worst, 16.0);
  EXPECT_GT(share(*baked, TexelOrigin::strict), 0.7);
  EXPECT_EQ(share(*baked, TexelOrigin::none), 0.0);
}

TEST_F(PaintedBox, TakesNothingFromTheBackground) {
  const auto baked = bake_texture(box_, photos_, small_options(), 2, silent);
  ASSERT_TRUE(baked);
  for (int y = 0; y < baked->albedo.rows; ++y) {
    for (int x = 0; x < baked->albedo.cols; ++x) EXPECT_FALSE(is_magenta(baked->albedo.at<cv::Vec3b>(y, x)));
  }
}

TEST_F(PaintedBox, TakesNothingFromTheBackgroundWithSlightlyWrongCameras) {
  for (std::size_t p = 0; p < photos_.size(); ++p) {
    photos_[p].cam_from_world.translation.x() += p % 2 == 0 ? 0.004 : -0.004;  // 2.5 pixels
  }
  const auto baked = bake_texture(box_, photos_, small_options(), 2, silent);
  ASSERT_TRUE(baked);
  for (int y = 0; y < baked->albedo.rows; ++y) {
    for (int x = 0; x < baked->albedo.cols; ++x) EXPECT_FALSE(is_magenta(baked->albedo.at<cv::Vec3b>(y, x)));
  }
}

TEST_F(PaintedBall, ShowsTheExposureGains) {
  std::vector<Photo> photos = scene::ring(ball_.mesh, scene::painting(ball_.mesh, 512), 10, 1.6);
  std::vector<double> gains;
  for (std::size_t p = 0; p < photos.size(); ++p) {
    gains.push_back(1.0 + 0.05 * std::sin(2.0 * static_cast<double>(p)));
    photos[p].image.forEach<cv::Vec3b>([&](cv::Vec3b& c, const int*) {
      for (int k = 0; k < 3; ++k) {
        const float linear = linear_from_encoded(c[k]) * static_cast<float>(gains.back());
        c[k] = cv::saturate_cast<std::uint8_t>(encoded_from_linear(linear));
      }
    });
  }
  const auto baked = bake_texture(ball_, photos, small_options(), 2, silent);
  ASSERT_TRUE(baked);
  double mean = 0;
  for (std::size_t p = 0; p < gains.size(); ++p) mean += std::log(gains[p] * baked->gains[p][1]) / gains.size();
  for (std::size_t p = 0; p < gains.size(); ++p) {
    EXPECT_NEAR(std::log(gains[p] * baked->gains[p][1]), mean, 0.01) << p;
  }
}

TEST_F(PaintedBox, DoesNotDependOnThreads) {
  const auto one = bake_texture(box_, photos_, small_options(), 1, silent);
  const auto three = bake_texture(box_, photos_, small_options(), 3, silent);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(cv::norm(one->albedo, three->albedo, cv::NORM_INF), 0.0);
  EXPECT_EQ(cv::norm(one->source, three->source, cv::NORM_INF), 0.0);
}

TEST_F(PaintedBall, BlurredPhotographsAreAvoided) {
  cv::Mat speckled = scene::painting(ball_.mesh, 512);
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) speckled.at<cv::Vec3b>(y, x) *= (x / 6 + y / 6) % 2 == 0 ? 1.0 : 0.6;
  }
  std::vector<Photo> photos = scene::ring(ball_.mesh, speckled, 10, 1.6);
  cv::GaussianBlur(photos[0].image, photos[0].image, {0, 0}, 3.0);
  const auto baked = bake_texture(ball_, photos, small_options(), 2, silent);
  ASSERT_TRUE(baked);
  EXPECT_LT(baked->sharpness[0], 0.7);
  EXPECT_GT(baked->sharpness[2], 0.9);
  EXPECT_LT(baked->texels_of[0], baked->texels_of[2] / 2);
}

TEST_F(PaintedBox, FillsWhatNobodySaw) {
  box_.mesh.colours.clear();
  const cv::Mat plain(512, 512, CV_8UC3, cv::Scalar(60, 120, 180));
  photos_ = {scene::photograph(box_.mesh, plain, {0.2, 0.1, 1.6}),
             scene::photograph(box_.mesh, plain, {-0.2, 0.1, 1.6})};
  const auto baked = bake_texture(box_, photos_, small_options(), 2, silent);
  ASSERT_TRUE(baked);
  EXPECT_GT(share(*baked, TexelOrigin::filled), 0.5);
  for (int y = 0; y < baked->albedo.rows; ++y) {
    for (int x = 0; x < baked->albedo.cols; ++x) {
      EXPECT_LE(cv::norm(baked->albedo.at<cv::Vec3b>(y, x), cv::Vec3b(60, 120, 180), cv::NORM_INF), 3.0);
    }
  }
}

TEST(Occluder, NeverPaintsWhatItHides) {
  // A green plate floats in front of a red box; both are part of the surface.
  BakeSubject subject;
  scene::add_box(subject.mesh, {0, 0, 0}, {0.2, 0.3, 0.15}, 10, {0, 0}, 0.5);
  const std::size_t of_box = subject.mesh.triangles.size();
  scene::add_box(subject.mesh, {0, 0, 0.3}, {0.08, 0.08, 0.005}, 4, {0.5, 0.5}, 0.5);
  cv::Mat texture(512, 512, CV_8UC3, cv::Scalar(40, 40, 200));
  texture(cv::Rect(256, 256, 256, 256)) = cv::Scalar(40, 200, 40);
  const auto photos = scene::ring(subject.mesh, texture, 12, 1.6);
  const auto baked = bake_texture(subject, photos, small_options(), 2, silent);
  ASSERT_TRUE(baked) << baked.error().message();
  const Atlas atlas = map_atlas(subject.mesh.uv, subject.mesh.uv_triangles, 256, 0);
  for (std::size_t i = 0; i < atlas.texels(); ++i) {
    if (atlas.triangle[i] < 0) continue;
    const cv::Vec3b c = baked->albedo.at<cv::Vec3b>(static_cast<int>(i) / 256, static_cast<int>(i) % 256);
    if (static_cast<std::size_t>(atlas.triangle[i]) < of_box) {
      EXPECT_GT(c[2], c[1] + 100) << i;
    } else {
      EXPECT_GT(c[1], c[2] + 100) << i;
    }
  }
}

TEST(Bake, SaysWhatIsWrong) {
  BakeSubject box;
  scene::add_box(box.mesh, {0, 0, 0}, {0.2, 0.3, 0.15}, 2, {0, 0}, 1.0);
  EXPECT_FALSE(bake_texture(box, {}, small_options(), 1, silent));
  Photo away = scene::photograph(box.mesh, cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(90)), {0, 0, 1.6});
  away.cam_from_world = look_at({0, 0, 1.6}, {0, 0, 5});
  const auto unseen = bake_texture(box, {away}, small_options(), 1, silent);
  ASSERT_FALSE(unseen);
  EXPECT_NE(unseen.error().message().find("no photograph sees"), std::string::npos);
  BakeOptions huge;
  huge.size = 100000;
  const auto refused = bake_texture(box, {away}, huge, 1, silent);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().exit_code(), 2);
}

}  // namespace
}  // namespace gyre
