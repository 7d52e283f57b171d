// SPDX-License-Identifier: Apache-2.0
#include "common/wire/wire.h"

#include "tests/common/wire/sample_messages.h"

#include <gtest/gtest.h>
#include <set>

namespace gyre::wire {
namespace {

const std::string scan_id = "01ARZ3NDEKTSV4RRFFQ69G5FAV";
const std::string hash(64, '7');

const std::vector<Message> samples = sample_messages();

bool decodes(const Message& message) {
  return decode(encode(message)).has_value();
}

FileChunk chunk(const std::string& name, std::uint64_t size, std::uint64_t offset, std::size_t data) {
  return {scan_id, {name, size, hash}, offset, std::string(data, 'x')};
}

TEST(Wire, EveryMessageComesBackAsItWas) {
  std::set<std::size_t> kinds;
  for (const Message& message : sample_messages()) {
    const std::string bytes = encode(message);
    const Result<Message> back = decode(bytes);
    ASSERT_TRUE(back) << message.index() << ": " << back.error().message();
    EXPECT_EQ(back->index(), message.index());
    EXPECT_EQ(encode(*back), bytes);
    kinds.insert(back->index());
  }
  EXPECT_EQ(kinds.size(), std::variant_size_v<Message> - 1);  // all but Unknown
}

TEST(Wire, FieldsComeBackAsTheyWere) {
  const Result<Message> back = decode(encode(chunk("frames/head-000003.jpg", 1000, 990, 10)));
  ASSERT_TRUE(back);
  const auto& got = std::get<FileChunk>(*back);
  EXPECT_EQ(got.scan, scan_id);
  EXPECT_EQ(got.file.name, "frames/head-000003.jpg");
  EXPECT_EQ(got.file.size, 1000U);
  EXPECT_EQ(got.file.sha256, hash);
  EXPECT_EQ(got.offset, 990U);
  EXPECT_EQ(got.data, std::string(10, 'x'));
}

TEST(Wire, RefusesPathTricks) {
  for (const char* name : {"", ".", "..", "/etc/passwd", "../x", "frames/../x", "frames/..", "frames/", "frames//x.jpg",
                           "frames/sub/body-000001.jpg", "frames/body-1.jpg", "frames/body--00001.jpg", "a\nb", "a\\b",
                           "frames/body-000001.jpg/..", ".hidden", "spool.jsonl", "work/cameras/cameras.txt"}) {
    EXPECT_FALSE(decodes(chunk(name, 10, 0, 10))) << name;
    EXPECT_FALSE(decodes(Discard{scan_id, name})) << name;
    EXPECT_FALSE(decodes(ResultOffer{scan_id, {{name, 1, hash}}})) << name;
    EXPECT_FALSE(decodes(ScanClose{scan_id, {{name, 1, hash}}})) << name;
  }
  const std::string with_zero = std::string("avatar.glb") + '\0' + "x";
  EXPECT_FALSE(decodes(ResultOffer{scan_id, {{with_zero, 1, hash}}}));
  for (const char* id : {"", "../../x", "01ARZ3NDEKTSV4RRFFQ69G5FA/", "01ARZ3NDEKTSV4RRFFQ69G5FAVV"}) {
    EXPECT_FALSE(decodes(ResultAck{id})) << id;
    EXPECT_FALSE(decodes(ScanOpen{id, "{}"})) << id;
  }
}

TEST(Wire, RefusesWhatIsTooLargeOrOutsideItsFile) {
  const std::string name = "frames/body-000001.jpg";
  EXPECT_TRUE(decodes(chunk(name, max_chunk_bytes, 0, max_chunk_bytes)));
  EXPECT_FALSE(decodes(chunk(name, max_chunk_bytes + 1, 0, max_chunk_bytes + 1)));
  EXPECT_FALSE(decodes(chunk(name, 10, 5, 6)));
  EXPECT_FALSE(decodes(chunk(name, 10, ~0ULL, 10)));
  EXPECT_FALSE(decodes(chunk(name, 10, 5, 0)));
  EXPECT_TRUE(decodes(chunk(name, 0, 0, 0)));
  EXPECT_FALSE(decodes(ScanOpen{scan_id, std::string(max_description_bytes + 1, ' ')}));
  EXPECT_FALSE(decode(std::string(max_message_bytes + 1, '\0')));
  ScanClose close{scan_id, std::vector<FileEntry>(max_files, {name, 1, hash})};
  EXPECT_TRUE(decodes(close));
  close.files.push_back({name, 1, hash});
  EXPECT_FALSE(decodes(close));
  EXPECT_FALSE(decodes(FileAck{scan_id, name, "abc"}));
  EXPECT_FALSE(decodes(FileAck{scan_id, name, std::string(64, 'G')}));
}

TEST(Wire, RefusesAPairingThatIsNone) {
  const std::string key = std::get<PairAnswer>(*std::find_if(samples.begin(), samples.end(), [](const Message& m) {
                            return std::holds_alternative<PairAnswer>(m);
                          })).public_key;
  const std::string session(pair_session_bytes, 's');
  const std::string share(32, 'x');
  EXPECT_TRUE(decodes(PairRequest{"rig", key, session, share}));
  EXPECT_FALSE(decodes(PairRequest{"../rig", key, session, share}));
  EXPECT_FALSE(decodes(PairRequest{"", key, session, share}));
  EXPECT_FALSE(decodes(PairRequest{std::string(65, 'r'), key, session, share}));
  EXPECT_FALSE(decodes(PairRequest{"rig", key.substr(1), session, share}));
  EXPECT_FALSE(decodes(PairRequest{"rig", key, session.substr(1), share}));
  EXPECT_FALSE(decodes(PairRequest{"rig", key, session, share + "x"}));
  EXPECT_FALSE(decodes(PairAnswer{key, ""}));
  EXPECT_FALSE(decodes(PairProof{std::string(63, 't')}));
  EXPECT_FALSE(decodes(PairDone{std::string(65, 't')}));
}

TEST(Wire, RefusesStatusAndCoverageBeyondTheirLimits) {
  EXPECT_TRUE(decodes(DeviceStatus{"ready", "", "", 0, 0, 0}));
  EXPECT_FALSE(decodes(DeviceStatus{"ready", "", "../x", 0, 0, 0}));
  const CoverageBand band{"body upper", 1.0, std::string(max_cells, 'c')};
  CoveragePreview preview{scan_id, "body", std::vector<CoverageBand>(max_bands, band)};
  EXPECT_TRUE(decodes(preview));
  preview.bands[3].cells += 'c';
  EXPECT_FALSE(decodes(preview));
  preview.bands[3] = {"body upper", 1.5, ""};
  EXPECT_FALSE(decodes(preview));
  preview.bands.assign(max_bands + 1, band);
  EXPECT_FALSE(decodes(preview));
  EXPECT_FALSE(decodes(CoveragePreview{"", "body", {}}));
  Hello hello;
  hello.capabilities.assign(max_capabilities, "one");
  EXPECT_TRUE(decodes(hello));
  hello.capabilities.emplace_back("more");
  EXPECT_FALSE(decodes(hello));
}

// What the first version of the protocol sent and understands: field 1 of the envelope is Hello with 1, 0 and a name.
TEST(Wire, SpeaksWithTheFirstVersion) {
  const std::string old_hello("\x0a\x07\x08\x01\x1a\x03rig", 9);
  const Result<Message> hello = decode(old_hello);
  ASSERT_TRUE(hello);
  EXPECT_EQ(std::get<Hello>(*hello).device_name, "rig");
  EXPECT_TRUE(std::get<Hello>(*hello).capabilities.empty());
  EXPECT_EQ(std::get<Hello>(*hello).deadline_ms, 0U);
  // And the bytes of a hello that promises nothing are those of before, but for the minor version.
  EXPECT_EQ(encode(Hello{1, 0, "rig"}), old_hello);
}

TEST(Wire, LargestMessagesFit) {
  const std::string name = "frames/" + std::string(100, 'p') + "-000001.jpg";
  ScanState state{scan_id, ScanPhase::receiving, std::string(max_text_bytes, 't'), {}};
  state.files.assign(max_files, {{name, 1ULL << 40, hash}, 1ULL << 40, true});
  EXPECT_TRUE(decodes(state));
}

TEST(Wire, TextFromAPeerIsOneLineOfValidUtf8) {
  const auto reason = [](const std::string& text) {
    return std::get<Refused>(decode(encode(Refused{text, false})).value()).reason;
  };
  EXPECT_EQ(reason("line\nbreak \x1b[31m"), "line?break ?[31m");
  EXPECT_EQ(reason("Körper – 人"), "Körper – 人");
  EXPECT_EQ(reason("\xff\xc3"), "??");
  EXPECT_EQ(reason("\xed\xa0\x80"), "???");  // a surrogate
  EXPECT_EQ(reason(std::string(2 * max_text_bytes, 'a')).size(), max_text_bytes);
}

TEST(Wire, MessagesOfALaterVersionAreUnknownNotErrors) {
  const std::string field_99_empty = "\x9a\x06";
  const Result<Message> message = decode(field_99_empty + std::string(1, '\0'));
  ASSERT_TRUE(message);
  EXPECT_TRUE(std::holds_alternative<Unknown>(*message));
}

}  // namespace
}  // namespace gyre::wire
