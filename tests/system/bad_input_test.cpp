// SPDX-License-Identifier: Apache-2.0
// What the programs say about input they cannot use: one clear line and exit code 1 or 2.
#include "common/bundle/atomic_file.h"
#include "tests/system/programs.h"

#include <gtest/gtest.h>
#include <unistd.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace gyre {
namespace {

namespace fs = std::filesystem;

class BadInput : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::path(testing::TempDir()) /
            ("bad-" + std::to_string(::getpid()) + "-" + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(root_);
  }
  void TearDown() override { fs::remove_all(root_); }

  std::string at(const std::string& name) const { return (root_ / name).string(); }

  // Writes n pictures of a texture that moves by `step` pixels a frame.
  std::string pictures(const std::string& name, int n, int step, bool textured = true, cv::Size last = {160, 120}) {
    fs::create_directories(root_ / name);
    cv::Mat texture(120, 2000, CV_8UC3, cv::Scalar(128, 128, 128));
    if (textured) {
      cv::RNG random(7);
      random.fill(texture, cv::RNG::UNIFORM, 0, 255);
      cv::GaussianBlur(texture, texture, {}, 1.5);
    }
    for (int i = 0; i < n; ++i) {
      cv::Mat picture = texture(cv::Rect(i * step, 0, 160, 120)).clone();
      if (i == n - 1 && last != picture.size()) cv::resize(picture, picture, last);
      cv::imwrite(at(name + "/" + std::to_string(1000 + i) + ".jpg"), picture);
    }
    return at(name);
  }

  static void expect_one_line(const Finished& f, int code, const std::string& part) {
    EXPECT_EQ(f.code, code) << f.err;
    const std::string line = last_line(f.err);
    EXPECT_NE(line.find(part), std::string::npos) << f.err;
    EXPECT_EQ(f.err.find("terminate called"), std::string::npos) << f.err;
  }

  Finished replay(const std::string& capture) {
    return run_program("gyre-device", {"--log-level", "error", "replay", capture, "--spool", at("spool"), "--keys",
                                       at("keys"), "--height-mm", "1700"});
  }
  Finished reconstruct(const std::string& capture) {
    return run_program("gyre-offload", {"--log-level", "error", "reconstruct", capture, "--out", at("out"),
                                        "--height-mm", "1700", "--until", "cameras"});
  }

  fs::path root_;
};

TEST_F(BadInput, MissingCapture) {
  expect_one_line(replay(at("nothing.mp4")), 1, "nothing.mp4");
  expect_one_line(reconstruct(at("nothing.mp4")), 2, "nothing.mp4");
}

TEST_F(BadInput, NotAVideo) {
  ASSERT_TRUE(write_file(root_ / "text.mp4", "this is no video\n"));
  expect_one_line(replay(at("text.mp4")), 1, "text.mp4");
  expect_one_line(reconstruct(at("text.mp4")), 1, "text.mp4");
}

TEST_F(BadInput, EmptyFolder) {
  fs::create_directories(root_ / "empty");
  expect_one_line(replay(at("empty")), 1, "empty");
  expect_one_line(reconstruct(at("empty")), 1, "empty");
}

TEST_F(BadInput, TooFewFrames) {
  expect_one_line(replay(pictures("few", 3, 10)), 1, "frames");
  expect_one_line(reconstruct(pictures("two", 2, 10)), 1, "few");
}

TEST_F(BadInput, NothingMoves) {
  cv::Mat picture(120, 160, CV_8UC3);
  cv::RNG(7).fill(picture, cv::RNG::UNIFORM, 0, 255);
  cv::GaussianBlur(picture, picture, {}, 1.5);
  {
    cv::VideoWriter video(at("still.avi"), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 15, picture.size());
    for (int i = 0; i < 20; ++i) video.write(picture);
  }
  expect_one_line(replay(at("still.avi")), 1, "move");
  expect_one_line(reconstruct(at("still.avi")), 1, "move");
}

TEST_F(BadInput, MixedSizes) {
  const std::string folder = pictures("mixed", 12, 10, true, {80, 60});
  expect_one_line(replay(folder), 1, "size");
  expect_one_line(reconstruct(folder), 1, "size");
}

TEST_F(BadInput, NoFeatures) {
  expect_one_line(reconstruct(pictures("grey", 12, 10, false)), 1, "texture");
}

TEST_F(BadInput, UnreachableHostKeepsTheScan) {
  const std::string key = "rq:rM>}U?@Lns47E1%kR.o@n%FcmmsL/@{H8]yf7";
  ASSERT_EQ(run_program("gyre-device", {"pair", "--keys", at("keys"), "--host-public-key", key}).code, 0);
  const Finished f =
      run_program("gyre-device", {"--log-level", "error", "replay", pictures("good", 30, 10), "--spool", at("spool"),
                                  "--keys", at("keys"), "--host", "tcp://127.0.0.1:1", "--patience-s", "0.5"});
  EXPECT_EQ(f.code, 1) << f.err;
  const Finished status = run_program("gyre-device", {"status", "--page", "off", "--spool", at("spool")});
  EXPECT_EQ(status.code, 0);
  EXPECT_NE(status.out.find("closed"), std::string::npos) << status.out;
}

TEST_F(BadInput, WrongUseIsCodeTwo) {
  EXPECT_EQ(run_program("gyre-offload", {"dance"}).code, 2);
  EXPECT_EQ(run_program("gyre-offload", {"reconstruct"}).code, 2);
  EXPECT_EQ(run_program("gyre-offload", {"reconstruct", at("x"), "--out", at("y"), "--height-mm", "-3"}).code, 2);
  EXPECT_EQ(run_program("gyre-offload", {"stage", "dance", at("x")}).code, 2);
  EXPECT_EQ(run_program("gyre-device", {"replay"}).code, 2);
  EXPECT_EQ(run_program("gyre-device", {}).code, 2);
}

TEST_F(BadInput, AFolderThatIsNoScanIsLeftAlone) {
  fs::create_directories(root_ / "out");
  ASSERT_TRUE(write_file(root_ / "out" / "thesis.txt", "precious"));
  expect_one_line(reconstruct(pictures("good", 12, 10)), 2, "not empty");
  EXPECT_EQ(*read_file(root_ / "out" / "thesis.txt"), "precious");
}

TEST_F(BadInput, ABoardIsWrittenToAFileOnly) {
  const auto calibrate = [](const std::string& file) {
    return run_program("gyre-device", {"calibrate", "--board-pdf", file});
  };
  EXPECT_EQ(calibrate(at("board.pdf")).code, 0);
  EXPECT_TRUE(read_file(root_ / "board.pdf")->starts_with("%PDF-"));
  EXPECT_EQ(calibrate(at("board.pdf")).code, 0);
  expect_one_line(calibrate(at("nowhere/board.pdf")), 1, "nowhere");
  expect_one_line(calibrate(root_.string()), 2, "not a file");
  EXPECT_EQ(run_program("gyre-device", {"calibrate", "--board-pdf", at("x.pdf"), "--paper", "napkin"}).code, 2);
}

TEST_F(BadInput, HelpNamesEveryOption) {
  for (const char* verb : {"serve", "reconstruct", "stage", "template", "pair", "evaluate", "store"}) {
    const Finished f = run_program("gyre-offload", {verb, "--help"});
    EXPECT_EQ(f.code, 0) << verb;
    EXPECT_FALSE(f.out.empty()) << verb;
  }
  for (const char* verb : {"run", "replay", "panel", "pair", "status", "calibrate"})
    EXPECT_EQ(run_program("gyre-device", {verb, "--help"}).code, 0) << verb;
}

}  // namespace
}  // namespace gyre
