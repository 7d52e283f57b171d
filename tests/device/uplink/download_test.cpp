// SPDX-License-Identifier: Apache-2.0
#include "device/uplink/download.h"

#include "common/bundle/atomic_file.h"
#include "common/bundle/sha256.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>

namespace gyre {
namespace {

// A download of which the test plays the host.
class DownloadTest : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(spool_scan(*spool_, scan_, {1}, 100, 1));
    const SpooledScan now = *spool_->scan(scan_.id);
    for (const SpooledFile& file : now.files) {
      ASSERT_TRUE(spool_->acknowledge_file(scan_.id, file.name, file.sha256));
    }
    ASSERT_TRUE(spool_->acknowledge_scan(scan_.id));
    avatar_.resize(20 * wire::max_chunk_bytes + 5);
    for (std::size_t i = 0; i < avatar_.size(); ++i) avatar_[i] = static_cast<char>(i * 31 / 7);
  }
  wire::ResultOffer offer() const {
    return {scan_.id, {{"avatar.glb", avatar_.size(), sha256(avatar_)}, {"empty.json", 0, sha256("")}}};
  }
  Download::Send send() {
    return [this](wire::Message message) -> Result<void> {
      sent_.push_back(std::move(message));
      return {};
    };
  }
  // Answers requests until nothing is asked for any more, or `most` were answered.
  Result<void> serve(Download& download, int most) {
    while (!sent_.empty() && most-- > 0 && std::holds_alternative<wire::ResultRequest>(sent_.front())) {
      const auto request = std::get<wire::ResultRequest>(sent_.front());
      sent_.erase(sent_.begin());
      const std::string& content = request.name == "avatar.glb" ? avatar_ : empty_;
      Result<void> done = download.on({scan_.id, request.name, request.sha256, request.offset,
                                       content.substr(request.offset, wire::max_chunk_bytes)},
                                      send());
      if (!done) return done;
    }
    return {};
  }
  std::string received() const { return read_file(spool_->bundle(scan_.id).root() / "avatar.glb").value_or("none"); }

  TemporaryFolder folder_;
  const std::unique_ptr<Spool> spool_ = Spool::open(folder_.path()).value();
  const Scan scan_ = small_scan();
  std::string avatar_;
  const std::string empty_;
  std::vector<wire::Message> sent_;
};

constexpr int all = 1000;

TEST_F(DownloadTest, FetchesEveryFileAndDeliversTheScan) {
  Download download(*spool_, offer());
  ASSERT_TRUE(download.start(send()));
  EXPECT_EQ(sent_.size(), 8U);  // the window
  ASSERT_TRUE(serve(download, all));
  EXPECT_TRUE(download.finished());
  EXPECT_EQ(received(), avatar_);
  EXPECT_EQ(spool_->phase(scan_.id), SpoolPhase::delivered);
  ASSERT_EQ(sent_.size(), 1U);
  EXPECT_TRUE(std::holds_alternative<wire::ResultAck>(sent_.front()));
}

TEST_F(DownloadTest, ChunksThatOvertakeOneAnotherHoldNothingUp) {
  Download download(*spool_, offer());
  ASSERT_TRUE(download.start(send()));
  int answered = 0;
  for (; !download.finished() && answered < all; answered += 2) {
    if (sent_.size() > 1 && std::holds_alternative<wire::ResultRequest>(sent_[1])) std::swap(sent_[0], sent_[1]);
    ASSERT_TRUE(serve(download, 2));
  }
  EXPECT_TRUE(download.finished());
  EXPECT_LT(answered, 200);  // of 22 chunks: what is asked for again is bounded
  EXPECT_EQ(received(), avatar_);
}

TEST_F(DownloadTest, GoesOnWhereTheLastConnectionEnded) {
  {
    Download download(*spool_, offer());
    ASSERT_TRUE(download.start(send()));
    ASSERT_TRUE(serve(download, 7));
    EXPECT_EQ(received(), "none");
    sent_.clear();
  }
  Download download(*spool_, offer());
  ASSERT_TRUE(download.start(send()));
  EXPECT_EQ(std::get<wire::ResultRequest>(sent_.front()).offset, 7 * wire::max_chunk_bytes);
  ASSERT_TRUE(serve(download, all));
  EXPECT_EQ(received(), avatar_);
}

TEST_F(DownloadTest, ACompleteButUncheckedFileIsChecked) {
  const auto part = spool_->bundle(scan_.id).root() / ("avatar.glb." + sha256(avatar_) + ".part");
  ASSERT_TRUE(write_file(part, avatar_));
  Download download(*spool_, offer());
  ASSERT_TRUE(download.start(send()));
  ASSERT_TRUE(serve(download, 1));
  EXPECT_EQ(received(), avatar_);
}

TEST_F(DownloadTest, ADamagedFileIsFetchedAgainAndNeverKept) {
  const auto part = spool_->bundle(scan_.id).root() / ("avatar.glb." + sha256(avatar_) + ".part");
  ASSERT_TRUE(write_file(part, std::string(3000, 'x')));
  Download download(*spool_, offer());
  ASSERT_TRUE(download.start(send()));
  ASSERT_TRUE(serve(download, all));
  EXPECT_EQ(received(), avatar_);
}

TEST_F(DownloadTest, AHostThatAlwaysSendsDamageIsAnError) {
  const wire::ResultOffer honest = offer();
  Download download(*spool_, honest);
  avatar_[5] = static_cast<char>(avatar_[5] + 1);
  ASSERT_TRUE(download.start(send()));
  EXPECT_FALSE(serve(download, all));
  EXPECT_EQ(received(), "none");
}

TEST_F(DownloadTest, AHostWithLessThanItSaysIsAnError) {
  Download download(*spool_, offer());
  avatar_.resize(avatar_.size() / 2);
  ASSERT_TRUE(download.start(send()));
  EXPECT_FALSE(serve(download, all));
}

TEST_F(DownloadTest, ChunksNobodyAskedForChangeNothing) {
  Download download(*spool_, offer());
  ASSERT_TRUE(download.start(send()));
  ASSERT_TRUE(download.on({scan_.id, "avatar.glb", sha256("other"), 0, "xxx"}, send()));
  ASSERT_TRUE(download.on({scan_.id, "avatar.glb", sha256(avatar_), 1, "xxx"}, send()));
  ASSERT_TRUE(download.on({scan_.id, "other.glb", sha256(avatar_), 0, "xxx"}, send()));
  ASSERT_TRUE(serve(download, all));
  EXPECT_EQ(received(), avatar_);
}

}  // namespace
}  // namespace gyre
