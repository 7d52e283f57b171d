// SPDX-License-Identifier: Apache-2.0
// What is asked of cameras that are not here: their configurations are played, the buffers are memory.
#include "device/camera/libcamera_streams.h"

#include "device/camera/libcamera_buffer.h"

#include <gtest/gtest.h>
#include <libcamera/formats.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <unistd.h>
#include <functional>
#include <numeric>
#include <sstream>

namespace gyre {
namespace {

namespace lc = libcamera;

using Formats = std::map<lc::PixelFormat, std::vector<lc::SizeRange>>;
using Status = lc::CameraConfiguration::Status;

const lc::SizeRange any_size({64, 64}, {4056, 3040});

// A camera that offers these streams; `validate` is what the driver thinks of what is asked for.
class PlayedConfiguration : public lc::CameraConfiguration {
 public:
  using Validate = std::function<Status(PlayedConfiguration&)>;

  PlayedConfiguration(const std::vector<Formats>& streams, Validate validate) : validate_(std::move(validate)) {
    for (const Formats& formats : streams) {
      lc::StreamConfiguration stream{lc::StreamFormats(formats)};
      stream.pixelFormat = formats.begin()->first;
      stream.size = {1920, 1080};
      stream.bufferCount = 1;
      addConfiguration(stream);
    }
  }
  Status validate() override { return validate_ ? validate_(*this) : Valid; }

 private:
  Validate validate_;
};

class LibcameraStreams : public testing::Test {
 protected:
  LibcameraStreams() : before_(spdlog::default_logger()) {
    spdlog::set_default_logger(
        std::make_shared<spdlog::logger>("test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log_)));
  }
  ~LibcameraStreams() override { spdlog::set_default_logger(before_); }

  // streams: of the camera, of which it gives as many as are asked for.
  auto choose(const std::vector<Formats>& streams, const PlayedConfiguration::Validate& validate = {}) {
    const StreamOffer offer = [&](const std::vector<lc::StreamRole>& roles) {
      const std::size_t count = std::min(roles.size(), streams.size());
      return std::make_unique<PlayedConfiguration>(std::vector(streams.begin(), streams.begin() + count), validate);
    };
    return choose_streams(offer, name_, "camera");
  }

  CameraName name_{.kind = CameraName::Kind::libcamera, .buffers = 3};
  std::ostringstream log_;

 private:
  std::shared_ptr<spdlog::logger> before_;
};

TEST_F(LibcameraStreams, ASensorGivesAFullPictureAndASmallOneAtOnce) {
  const Formats processed = {{lc::formats::XRGB8888, {any_size}}, {lc::formats::YUV420, {any_size}}};
  name_.width = 4056;
  name_.height = 3040;
  const auto chosen = choose({processed, processed});
  ASSERT_TRUE(chosen) << chosen.error().message();
  ASSERT_EQ((*chosen)->size(), 2U);
  const lc::StreamConfiguration& full = (*chosen)->at(0);
  const lc::StreamConfiguration& small = (*chosen)->at(1);
  EXPECT_EQ(full.size, lc::Size(4056, 3040));
  EXPECT_EQ(full.pixelFormat, lc::formats::YUV420);
  EXPECT_EQ(full.bufferCount, 3U);
  EXPECT_EQ(small.size, lc::Size(640, 478));
  EXPECT_EQ(small.pixelFormat, lc::formats::YUV420);
  EXPECT_EQ(small.bufferCount, 3U);
  EXPECT_NE(log_.str().find("camera: 4056x3040-YUV420, 3 buffers and 640x478-YUV420, 3 buffers"), std::string::npos)
      << log_.str();
  EXPECT_EQ(log_.str().find("was asked for"), std::string::npos);
}

TEST_F(LibcameraStreams, WithoutASizeItIsWhatTheCameraLikes) {
  const Formats processed = {{lc::formats::NV12, {any_size}}};
  const auto chosen = choose({processed, processed});
  ASSERT_TRUE(chosen);
  EXPECT_EQ((*chosen)->at(0).size, lc::Size(1920, 1080));
  EXPECT_EQ((*chosen)->at(1).size, lc::Size(640, 360));
}

TEST_F(LibcameraStreams, WhatIsAdjustedIsTakenAndSaid) {
  const Formats processed = {{lc::formats::YUV420, {any_size}}};
  const auto chosen = choose({processed, processed}, [](PlayedConfiguration& configuration) {
    configuration.at(0).size = {1912, 1072};
    configuration.at(1).pixelFormat = lc::formats::NV12;
    configuration.at(1).bufferCount = 4;
    return Status::Adjusted;
  });
  ASSERT_TRUE(chosen);
  EXPECT_EQ((*chosen)->at(0).size, lc::Size(1912, 1072));
  const std::string log = log_.str();
  EXPECT_NE(log.find("camera: 1912x1072-YUV420, 3 buffers and 640x360-NV12, 4 buffers"), std::string::npos) << log;
  EXPECT_NE(log.find("camera: 1920x1080-YUV420, 3 buffers and 640x360-YUV420, 3 buffers was asked for"),
            std::string::npos)
      << log;
}

TEST_F(LibcameraStreams, OneStreamServesBothWhereThereAreNoTwoThatCanBeRead) {
  const Formats compressed = {{lc::formats::MJPEG, {lc::SizeRange({1280, 720}), lc::SizeRange({640, 480})}}};
  const Formats bayer = {{lc::formats::SBGGR8, {any_size}}};
  const Formats processed = {{lc::formats::YUV420, {any_size}}};
  name_.width = 700;
  name_.height = 500;
  const auto usb = choose({compressed});
  ASSERT_TRUE(usb);
  ASSERT_EQ((*usb)->size(), 1U);
  EXPECT_EQ((*usb)->at(0).size, lc::Size(640, 480));
  const auto raw_second = choose({processed, bayer});
  ASSERT_TRUE(raw_second);
  EXPECT_EQ((*raw_second)->size(), 1U);
  // The driver has something against two, or makes of the second what cannot be read.
  const auto refused = choose({processed, processed}, [](PlayedConfiguration& configuration) {
    return configuration.size() == 2 ? Status::Invalid : Status::Valid;
  });
  ASSERT_TRUE(refused);
  EXPECT_EQ((*refused)->size(), 1U);
  const auto unreadable = choose({processed, processed}, [](PlayedConfiguration& configuration) {
    if (configuration.size() == 1) return Status::Valid;
    configuration.at(1).pixelFormat = lc::formats::XRGB8888;
    return Status::Adjusted;
  });
  ASSERT_TRUE(unreadable);
  EXPECT_EQ((*unreadable)->size(), 1U);
}

TEST_F(LibcameraStreams, ACameraThatCannotBeReadIsAnError) {
  const auto bayer = choose({{{lc::formats::SBGGR8, {any_size}}}});
  ASSERT_FALSE(bayer);
  EXPECT_EQ(bayer.error().where, "camera");
  EXPECT_FALSE(choose({{{lc::formats::NV12, {any_size}}}}, [](PlayedConfiguration&) { return Status::Invalid; }));
  EXPECT_FALSE(choose({}));
}

// A frame buffer of anonymous memory, which holds 0, 1, 2, ...
class Memory {
 public:
  explicit Memory(std::size_t size) : bytes_(size) {
    std::iota(bytes_.begin(), bytes_.end(), std::uint8_t{0});
    const int fd = ::memfd_create("buffer", MFD_CLOEXEC);
    EXPECT_EQ(::write(fd, bytes_.data(), size), static_cast<ssize_t>(size));
    fd_ = lc::SharedFD(fd);
    ::close(fd);
  }
  // Planes one after the other, of these lengths.
  std::unique_ptr<lc::FrameBuffer> buffer(const std::vector<unsigned>& lengths) const {
    std::vector<lc::FrameBuffer::Plane> planes;
    unsigned offset = 0;
    for (const unsigned length : lengths) {
      planes.push_back({fd_, offset, length});
      offset += length;
    }
    return std::make_unique<lc::FrameBuffer>(planes);
  }
  // Rows of `width` bytes, `stride` apart, from `offset` on.
  std::vector<std::uint8_t> rows(std::size_t offset, std::size_t width, std::size_t stride, std::size_t count) const {
    std::vector<std::uint8_t> all;
    for (std::size_t y = 0; y < count; ++y) {
      for (std::size_t x = 0; x < width; ++x) all.push_back(bytes_.at(offset + y * stride + x));
    }
    return all;
  }

 private:
  std::vector<std::uint8_t> bytes_;
  lc::SharedFD fd_;
};

lc::StreamConfiguration stream_of(const lc::PixelFormat& format, unsigned stride) {
  lc::StreamConfiguration stream;
  stream.pixelFormat = format;
  stream.size = {16, 8};
  stream.stride = stride;
  return stream;
}

TEST(LibcameraBuffer, PicturesAreCopiedWithoutWhatPadsTheirRows) {
  const Memory memory(2000);
  const auto planar = memory.buffer({160, 40, 40});
  const MappedBuffer planes(*planar);
  ASSERT_TRUE(planes.whole());
  const auto i420 = copy_raw(planes, stream_of(lc::formats::YUV420, 20));
  ASSERT_TRUE(i420);
  std::vector<std::uint8_t> expected = memory.rows(0, 16, 20, 8);
  for (const std::size_t offset : {160, 200}) {
    for (const std::uint8_t byte : memory.rows(offset, 8, 10, 4)) expected.push_back(byte);
  }
  EXPECT_EQ(i420->bytes, expected);

  // In one plane, one part after the other.
  const auto whole = memory.buffer({240});
  const MappedBuffer one(*whole);
  const auto nv12 = copy_raw(one, stream_of(lc::formats::NV12, 20));
  ASSERT_TRUE(nv12);
  EXPECT_EQ(nv12->bytes, memory.rows(0, 16, 20, 12));
  const auto rgb_buffer = memory.buffer({512});
  const auto rgb = copy_raw(MappedBuffer(*rgb_buffer), stream_of(lc::formats::BGR888, 64));
  ASSERT_TRUE(rgb);
  EXPECT_EQ(rgb->format, RawPicture::Format::rgb);
  EXPECT_EQ(rgb->bytes, memory.rows(0, 48, 64, 8));
}

TEST(LibcameraBuffer, OneThatIsTooShortIsNoPicture) {
  const Memory memory(2000);
  EXPECT_TRUE(copy_raw(MappedBuffer(*memory.buffer({236})), stream_of(lc::formats::NV12, 20)));
  EXPECT_FALSE(copy_raw(MappedBuffer(*memory.buffer({235})), stream_of(lc::formats::NV12, 20)));
  EXPECT_FALSE(copy_raw(MappedBuffer(*memory.buffer({160, 40, 30})), stream_of(lc::formats::YUV420, 20)));
}

TEST(LibcameraBuffer, AJpegIsAsLongAsTheCameraSays) {
  const Memory memory(300);
  const auto buffer = memory.buffer({300});
  const MappedBuffer mapped(*buffer);
  const auto text = [&](std::size_t size) {
    const auto bytes = memory.rows(0, size, 0, 1);
    return std::string(bytes.begin(), bytes.end());
  };
  EXPECT_EQ(copy_jpeg(mapped, 100), text(100));
  EXPECT_EQ(copy_jpeg(mapped, 1000), text(300));
}

TEST(LibcameraBuffer, WhatCannotBeMappedIsNotWhole) {
  const lc::FrameBuffer nothing({{lc::SharedFD(), 0, 100}});
  EXPECT_FALSE(MappedBuffer(nothing).whole());
}

}  // namespace
}  // namespace gyre
