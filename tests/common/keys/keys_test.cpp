// SPDX-License-Identifier: Apache-2.0
#include "common/keys/keys.h"

#include "common/bundle/atomic_file.h"
#include "tests/device/spool/scan_support.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <cstdlib>

namespace gyre {
namespace {

namespace fs = std::filesystem;

TEST(Keys, AreWrittenForTheOwnerOnlyAndReadBack) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "sub" / "device.key";
  const KeyPair keys = make_key_pair();
  EXPECT_TRUE(is_public_key(keys.public_key));
  ASSERT_TRUE(write_key_pair(file, keys));
  struct stat info {};
  ASSERT_EQ(::stat(file.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600U);
  const Result<KeyPair> back = read_key_pair(file);
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->public_key, keys.public_key);
  EXPECT_EQ(back->secret_key.reveal(), keys.secret_key.reveal());
  EXPECT_EQ(read_public_key(folder.path() / "sub" / "device.key.pub").value(), keys.public_key);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path() / "sub"), fs::directory_iterator()), 2);
}

TEST(Keys, AreNeverOverwritten) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "key";
  const Result<KeyPair> first = read_or_make_key_pair(file);
  ASSERT_TRUE(first);
  EXPECT_FALSE(write_key_pair(file, make_key_pair()));
  const Result<KeyPair> second = read_or_make_key_pair(file);
  ASSERT_TRUE(second);
  EXPECT_EQ(second->public_key, first->public_key);
}

TEST(Keys, RefusesAKeyOthersMayRead) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "key";
  const Result<KeyPair> keys = read_or_make_key_pair(file);
  ASSERT_TRUE(keys);
  fs::permissions(file, fs::perms::group_read, fs::perm_options::add);
  const Result<KeyPair> read = read_key_pair(file);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().message().find(keys->secret_key.reveal()), std::string::npos);
}

TEST(Keys, TakesWhatTheServiceManagerHandsOver) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "key";
  const Result<KeyPair> keys = read_or_make_key_pair(file);
  ASSERT_TRUE(keys);
  fs::permissions(file, fs::perms::owner_read | fs::perms::group_read);  // as systemd's access list shows
  ASSERT_FALSE(read_key_pair(file));
  ::setenv("CREDENTIALS_DIRECTORY", folder.path().c_str(), 1);
  const Result<KeyPair> read = read_key_pair(file);
  ::unsetenv("CREDENTIALS_DIRECTORY");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->public_key, keys->public_key);
}

TEST(Keys, RefusesWhatIsNoKey) {
  const TemporaryFolder folder;
  const fs::path file = folder.path() / "key";
  ASSERT_TRUE(write_file(file, std::string_view("nonsense\n")));
  fs::permissions(file, fs::perms::owner_read);
  EXPECT_FALSE(read_key_pair(file));
  EXPECT_FALSE(read_key_pair(folder.path() / "missing"));
  EXPECT_FALSE(is_public_key(""));
  EXPECT_FALSE(is_public_key(std::string(40, '~')));
  EXPECT_FALSE(is_public_key(std::string(40, '\0')));
  EXPECT_FALSE(is_public_key(make_key_pair().public_key + "0"));
}

TEST(AllowList, LetsInWhoIsOnIt) {
  const TemporaryFolder folder;
  const fs::path list = folder.path() / "devices";
  const std::string a = make_key_pair().public_key;
  const std::string b = make_key_pair().public_key;
  EXPECT_TRUE(authorised_devices(list).empty());
  EXPECT_FALSE(authorised_name(list, a));
  ASSERT_TRUE(authorise_device(list, "rig-a", a));
  ASSERT_TRUE(authorise_device(list, "rig-b", b));
  EXPECT_EQ(authorised_name(list, a), "rig-a");
  EXPECT_EQ(authorised_devices(list).size(), 2U);
  ASSERT_TRUE(revoke_device(list, "rig-a"));
  EXPECT_FALSE(authorised_name(list, a));
  EXPECT_FALSE(revoke_device(list, "rig-a"));
  EXPECT_EQ(authorised_name(list, b), "rig-b");
}

TEST(AllowList, IsReadAgainWhenItHasChanged) {
  const TemporaryFolder folder;
  const fs::path list = folder.path() / "devices";
  AllowList allowed(list);
  const std::string key = make_key_pair().public_key;
  EXPECT_FALSE(allowed.contains(key));
  for (int i = 0; i < 100; ++i) {  // faster than the file system's clock ticks
    ASSERT_TRUE(authorise_device(list, "rig", key));
    ASSERT_TRUE(allowed.contains(key));
    ASSERT_TRUE(revoke_device(list, "rig"));
    ASSERT_FALSE(allowed.contains(key));
  }
  // The key of a name is replaced.
  const std::string other = make_key_pair().public_key;
  ASSERT_TRUE(authorise_device(list, "rig", key));
  ASSERT_TRUE(allowed.contains(key));
  ASSERT_TRUE(authorise_device(list, "rig", other));
  EXPECT_FALSE(allowed.contains(key));
  EXPECT_TRUE(allowed.contains(other));
}

TEST(AllowList, RefusesBadNamesAndKeys) {
  const TemporaryFolder folder;
  const std::string key = make_key_pair().public_key;
  for (const char* name : {"", "..", "../x", "a/b", "a b"})
    EXPECT_FALSE(authorise_device(folder.path(), name, key)) << name;
  EXPECT_FALSE(authorise_device(folder.path(), std::string(65, 'a'), key));
  EXPECT_FALSE(authorise_device(folder.path(), "rig", "not a key"));
  EXPECT_FALSE(revoke_device(folder.path(), "../x"));
  EXPECT_TRUE(authorised_devices(folder.path()).empty());
}

}  // namespace
}  // namespace gyre
