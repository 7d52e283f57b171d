// SPDX-License-Identifier: Apache-2.0
#include "common/video/frame_source.h"
#include "common/bundle/atomic_file.h"
#include "common/video/image_folder.h"
#include "common/video/orient.h"
#include "tests/common/video/exif_bytes.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class Captures : public testing::Test {
 protected:
  void SetUp() override {
    const std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
    folder_ = fs::temp_directory_path() / ("gyre-video-" + name + "-" + std::to_string(::getpid()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  fs::path folder_;
};

cv::Mat scene(int index, int width = 64, int height = 48) {
  cv::Mat image(height, width, CV_8UC3, cv::Scalar(40, 80, 120));
  cv::rectangle(image, {4 + 3 * index, 6, 12, 10}, cv::Scalar(250, 20, 10), cv::FILLED);
  cv::rectangle(image, {30, 28, 20, 8}, cv::Scalar(10, 240, 60), cv::FILLED);
  return image;
}

void write_video(const fs::path& file, int frames) {
  cv::VideoWriter writer(file.string(), cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), 10.0, {64, 48});
  ASSERT_TRUE(writer.isOpened());
  for (int i = 0; i < frames; ++i) writer.write(scene(i));
}

// Writes the rotation that a phone held on its side puts into the track header of an MP4.
void rotate_container(const fs::path& file, int quarter_turns) {
  std::string bytes = read_file(file).value();
  const std::size_t header = bytes.find("tkhd");
  ASSERT_NE(header, std::string::npos);
  constexpr std::size_t matrix_offset = 4 + 40;  // version 0: type, then times, id, duration, layer, volume
  const std::int32_t cosine[] = {1, 0, -1, 0};
  const std::int32_t sine[] = {0, 1, 0, -1};
  const std::int32_t matrix[] = {
      cosine[quarter_turns], sine[quarter_turns], 0, -sine[quarter_turns], cosine[quarter_turns], 0, 0, 0, 0x40000000};
  for (std::size_t i = 0; i < 8; ++i) {
    const auto fixed_point = static_cast<std::uint32_t>(matrix[i]) << 16U;
    bytes.replace(header + matrix_offset + 4 * i, 4, test::number(fixed_point, 4, false));
  }
  ASSERT_TRUE(write_file(file, bytes));
}

std::vector<Frame> read_all(const fs::path& path) {
  std::vector<Frame> frames;
  const Result<std::unique_ptr<FrameSource>> source = open_capture(path);
  if (!source) {
    ADD_FAILURE() << source.error().message();
    return frames;
  }
  for (;;) {
    Result<std::optional<Frame>> frame = (*source)->next();
    if (!frame) {
      ADD_FAILURE() << frame.error().message();
      return frames;
    }
    if (!*frame) return frames;
    frames.push_back(std::move(**frame));
  }
}

std::string error_of(const fs::path& path) {
  const Result<std::unique_ptr<FrameSource>> source = open_capture(path);
  if (!source) return source.error().message();
  for (;;) {
    const Result<std::optional<Frame>> frame = (*source)->next();
    if (!frame) return frame.error().message();
    if (!*frame) return "";
  }
}

double difference(const cv::Mat& a, const cv::Mat& b) {
  return a.size() == b.size() ? cv::norm(a, b, cv::NORM_INF) : 255.0;
}

void write_picture(const fs::path& file, const cv::Mat& image) {
  ASSERT_TRUE(cv::imwrite(file.string(), image));
}

TEST_F(Captures, VideoGivesAllFramesWithTheirTimes) {
  write_video(folder_ / "a.mp4", 12);
  const std::vector<Frame> frames = read_all(folder_ / "a.mp4");
  ASSERT_EQ(frames.size(), 12U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(frames[i].index, static_cast<int>(i));
    EXPECT_NEAR(frames[i].time, 0.1 * static_cast<double>(i), 1e-3);
    EXPECT_EQ(frames[i].image.type(), CV_8UC3);
    EXPECT_LT(cv::norm(frames[i].image, scene(static_cast<int>(i)), cv::NORM_L1) / (64 * 48 * 3), 8.0);
  }
}

TEST_F(Captures, ContainerRotationIsAppliedExactlyOnce) {
  write_video(folder_ / "plain.mp4", 3);
  const std::vector<Frame> plain = read_all(folder_ / "plain.mp4");
  const Orientation turned[] = {Orientation::upright, Orientation::rotated_90, Orientation::rotated_180,
                                Orientation::rotated_270};
  for (int turns = 0; turns < 4; ++turns) {
    const fs::path file = folder_ / ("turned" + std::to_string(turns) + ".mp4");
    fs::copy_file(folder_ / "plain.mp4", file);
    rotate_container(file, turns);
    const std::vector<Frame> frames = read_all(file);
    ASSERT_EQ(frames.size(), plain.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      EXPECT_EQ(difference(frames[i].image, oriented(plain[i].image, turned[turns])), 0.0) << turns;
    }
  }
}

TEST_F(Captures, FolderComesInTheOrderOfItsNumbers) {
  const int order[] = {0, 1, 2, 9, 10, 11, 100};
  for (const int i : order) write_picture(folder_ / ("img-" + std::to_string(i) + ".png"), scene(i % 12));
  ASSERT_TRUE(write_file(folder_ / "README.txt", "not a picture"));
  const std::vector<Frame> frames = read_all(folder_);
  ASSERT_EQ(frames.size(), std::size(order));
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_EQ(difference(frames[i].image, scene(order[i] % 12)), 0.0) << i;
    EXPECT_EQ(frames[i].index, static_cast<int>(i));
    EXPECT_TRUE(frames[i].jpeg.empty());
  }
}

TEST(NaturalOrder, IsStrictAndComparesNumbersAsNumbers) {
  EXPECT_TRUE(natural_less("a2b", "a10b"));
  EXPECT_FALSE(natural_less("a10b", "a2b"));
  EXPECT_TRUE(natural_less("a01", "a1"));
  EXPECT_FALSE(natural_less("a1", "a01"));
  EXPECT_TRUE(natural_less("a", "a1"));
  EXPECT_TRUE(natural_less("7", "a"));
  EXPECT_FALSE(natural_less("same7", "same7"));
  EXPECT_TRUE(natural_less("x99999999999999999999998", "x99999999999999999999999"));
}

TEST_F(Captures, PicturesStandUprightWhateverTheirOrientation) {
  for (int value = 1; value <= 8; ++value) {
    const fs::path folder = folder_ / std::to_string(value);
    fs::create_directories(folder);
    std::vector<unsigned char> encoded;
    cv::imencode(".jpg", scene(2), encoded);
    const cv::Mat stored = cv::imdecode(encoded, cv::IMREAD_COLOR);
    const std::string file =
        test::jpeg_with_exif({encoded.begin(), encoded.end()}, test::tiff_with_orientation(value, value % 2 == 0));
    ASSERT_TRUE(write_file(folder / "a.jpg", file));
    const std::vector<Frame> frames = read_all(folder);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_EQ(difference(frames[0].image, oriented(stored, static_cast<Orientation>(value))), 0.0) << value;
    EXPECT_EQ(frames[0].jpeg, value == 1 ? file : "") << "only an upright file may be kept as it is";
  }
}

TEST_F(Captures, BadInputGetsOneClearLine) {
  EXPECT_NE(error_of(folder_ / "nothing.mp4").find("no such capture"), std::string::npos);
  EXPECT_NE(error_of(folder_).find("no JPEG or PNG"), std::string::npos);
  ASSERT_TRUE(write_file(folder_ / "text.mp4", "this is no video"));
  EXPECT_NE(error_of(folder_ / "text.mp4").find("not a video"), std::string::npos);
  ASSERT_TRUE(write_file(folder_ / "empty.mp4", ""));
  EXPECT_NE(error_of(folder_ / "empty.mp4").find("not a video"), std::string::npos);
}

TEST_F(Captures, DamagedPictureIsNamed) {
  write_picture(folder_ / "a.png", scene(0));
  ASSERT_TRUE(write_file(folder_ / "b.png", "garbage"));
  EXPECT_NE(error_of(folder_).find("b.png"), std::string::npos);
}

TEST_F(Captures, MixedSizesAreRefused) {
  write_picture(folder_ / "a.png", scene(0));
  write_picture(folder_ / "b.png", scene(0, 48, 64));
  const std::string error = error_of(folder_);
  EXPECT_NE(error.find("mixed size"), std::string::npos);
  EXPECT_NE(error.find("48x64"), std::string::npos);
}

}  // namespace
}  // namespace gyre
