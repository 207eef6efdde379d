// Bad input, one case at a time: one clear line, exit code 1, and the database as it was. Beside each, the
// same command with good input succeeds.
#include <signal.h>
#include <sqlite3.h>
#include <sys/resource.h>
#include <sys/stat.h>

#include "tests/cli/command.h"

namespace patchwork {

namespace {

constexpr uid_t kNobody = 65534;

// Every write beyond this many bytes of a file fails, as on a full disk.
std::function<void()> disk_of(std::uint64_t bytes) {
  return [bytes] {
    const rlimit limit{bytes, bytes};
    setrlimit(RLIMIT_FSIZE, &limit);
    signal(SIGXFSZ, SIG_IGN);
  };
}

// The rights of an ordinary person, where the test runs as root: to root nothing is read-only.
void give_up_root() {
  if (geteuid() == 0 && setuid(kNobody) != 0) _exit(126);
}

}  // namespace

class BadInput : public CliTest {
 protected:
  /// The command fails with `part` in its one line, into the old database and into a new one; neither shows
  /// it.
  void refused(const Words& files_and_options, const std::string& part, const Circumstances& c = {}) const {
    for (const std::string& db : {database_, in_directory("new.pwk")}) {
      Words words{"import", db};
      words.insert(words.end(), files_and_options.begin(), files_and_options.end());
      const Outcome o = run(words, c);
      EXPECT_SAYS(complaint(o), part);
      EXPECT_EQ(lines_of(complaint(o)).size(), 1u) << o.err;
      EXPECT_EQ(o.out, "");
    }
    EXPECT_EQ(content_hash(database_), before_);
    for (const char* suffix : {"", "-wal", "-shm"})
      EXPECT_FALSE(std::filesystem::exists(in_directory("new.pwk") + suffix)) << suffix;
  }
  void accepted(const Words& files_and_options) const {
    const std::string db = in_directory("good.pwk");
    std::filesystem::copy_file(database_, db, std::filesystem::copy_options::overwrite_existing);
    Words words{"import", db};
    words.insert(words.end(), files_and_options.begin(), files_and_options.end());
    const Outcome o = run(words);
    EXPECT_EQ(o.code, 0) << o.err;
    EXPECT_NE(content_hash(db), before_);
  }
  static RasterFile other() { return hill_file(60, 50, 300, 200); }

  const std::string database_ = hill_database(), before_ = content_hash(database_);
};

TEST_F(BadInput, MissingFile) {
  refused({in_directory("none.tif")}, "none.tif: there is no such file");
  accepted({make(other(), "there.tif")});
}

TEST_F(BadInput, TextFileNamedTif) {
  const std::string path = in_directory("text.tif");
  write_text(path, "x y height\n1 2 3\n");
  refused({path}, "text.tif: is not a raster that GDAL can read");
  make(other(), "text.tif");
  accepted({path});
}

TEST_F(BadInput, EmptyFileAndFolder) {
  write_text(in_directory("empty.tif"), "");
  refused({in_directory("empty.tif")}, "empty.tif");
  std::filesystem::create_directory(in_directory("folder"));
  refused({in_directory("folder")}, "folder");
}

TEST_F(BadInput, TruncatedTiff) {
  const std::string path = make(hill_file(400, 300, 300), "cut.tif");
  accepted({path});
  const auto size = std::filesystem::file_size(path);
  for (const double share : {0.9, 0.5, 0.01}) {
    std::filesystem::resize_file(path, std::uintmax_t(double(size) * share));
    refused({path}, "cut.tif");
  }
}

TEST_F(BadInput, TwoBandsWithoutAChoice) {
  RasterFile file = other();
  file.bands = 2;
  const std::string path = make(file, "two.tif");
  refused({path}, "two.tif: has 2 bands; choose the heights with --band");
  refused({path, "--band", "3"}, "no band 3");
  refused({path, "--band", "0"}, "no band 0");
  accepted({path, "--band", "2"});
}

TEST_F(BadInput, ACrsThatCannotBeTransformed) {
  RasterFile file = other();
  file.crs = R"(LOCAL_CS["building site",UNIT["metre",1]])";
  const std::string path = make(file, "site.tif");
  const Outcome o = run({"import", database_, path});
  EXPECT_SAYS(complaint(o), "site.tif");
  EXPECT_EQ(lines_of(complaint(o)).size(), 1u) << o.err;
  EXPECT_EQ(content_hash(database_), before_);
  file.crs = "EPSG:32610";
  make(file, "site.tif");
  accepted({path});
}

TEST_F(BadInput, AllNodata) {
  RasterFile file = other();
  file.nodata = -9999;
  file.at = [](int, int) { return -9999; };
  const std::string path = make(file, "void.tif");
  refused({path}, "void.tif: it holds no data");
  file.at = [](int i, int j) { return i < 30 ? -9999 : 10. * j; };
  make(file, "void.tif");
  accepted({path});
}

TEST_F(BadInput, OneSampleWide) {
  for (const auto& [width, height] : std::vector<std::pair<int, int>>{{1, 50}, {60, 1}, {1, 1}})
    refused({make(hill_file(width, height), "thin.tif")}, "at least 2 x 2");
  accepted({make(hill_file(2, 2), "thin.tif")});
}

// Beyond its last samples a grid is continued: a strip of two by far more than can be stored.
TEST_F(BadInput, TooNarrowForItsLength) {
  RasterFile file{.width = 2, .height = 40000, .type = GDT_Int32};
  file.at = [](int i, int) { return 1e8 * i; };
  refused({make(file, "strip.tif"), "--accuracy", "1"}, "strip.tif: it is too narrow for its length");
  file.height = 20;
  accepted({make(file, "strip.tif"), "--accuracy", "1"});
}

TEST_F(BadInput, ShearedAndNonFiniteGeotransforms) {
  RasterFile file = other();
  file.geotransform[2] = 5;
  refused({make(file, "odd.tif")}, "odd.tif: its geotransform is sheared");
  const auto place = [&](const std::string& geotransform) {
    make(other(), "good.tif");
    write_text(in_directory("odd.vrt"),
               "<VRTDataset rasterXSize=\"60\" rasterYSize=\"50\"><GeoTransform>" + geotransform +
                   "</GeoTransform><VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource>"
                   "<SourceFilename relativeToVRT=\"1\">good.tif</SourceFilename><SourceBand>1</SourceBand>"
                   "</SimpleSource></VRTRasterBand></VRTDataset>");
    return in_directory("odd.vrt");
  };
  refused({place("nan,10,0,5000000,0,-10")}, "odd.vrt: its geotransform is not finite");
  refused({place("500000,inf,0,5000000,0,-10")}, "odd.vrt: its geotransform");
  refused({place("500000,0,0,5000000,0,-10")}, "odd.vrt: its geotransform has a step of zero");
  accepted({place("500000,10,2,5000000,2,-10")});
}

TEST_F(BadInput, ImpossibleAccuracyAndOffset) {
  const std::string path = make(other(), "o.tif"), db = in_directory("new.pwk");
  for (const Words& option :
       {Words{"--accuracy", "-1"}, {"--accuracy", "nan"}, {"--vertical-offset", "inf"}}) {
    const Outcome o = run({"import", db, path, option[0], option[1]});
    EXPECT_EQ(o.code, 2) << "wrong usage";
    EXPECT_SAYS(o.err, option[0] + ": it must be");
    EXPECT_FALSE(std::filesystem::exists(db));
  }
  accepted({path, "--accuracy", "0", "--vertical-offset", "-3"});
}

TEST_F(BadInput, TilesThatAreNotOfOneGrid) {
  const std::string a = make(hill_file(), "a.tif"), b = make(hill_file(60, 50, 604), "b.tif");
  refused({a, b, "--join", "--name", "j"}, "b.tif");
  make(hill_file(60, 50, 600), "b.tif");
  accepted({a, b, "--join", "--name", "j"});
}

TEST_F(BadInput, FullDisk) {
  RasterFile file = hill_file(500, 400, 300);
  file.at = [](int i, int j) { return 300 + (i * 7919 + j * 104729) % 997 / 64.; };  // compresses badly
  const std::string path = make(file, "rough.tif");
  for (const std::uint64_t bytes : {4096, 40000, 100000})
    refused({path, "--quiet"}, ".pwk", {.in_child = disk_of(bytes)});
  accepted({path});
}

TEST_F(BadInput, DatabaseOfAnotherProgram) {
  const std::string path = in_directory("other.sqlite");
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(path.c_str(), &raw), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(raw, "CREATE TABLE t(a); INSERT INTO t VALUES(1)", nullptr, nullptr, nullptr),
            SQLITE_OK);
  sqlite3_close(raw);
  const std::string bytes = text_of(path), tif = make(other());
  for (const Words& words : {Words{"info", path}, Words{"import", path, tif}, Words{"sample", path}})
    EXPECT_SAYS(complaint(run(words)), "a database of another program");
  EXPECT_EQ(text_of(path), bytes);
  EXPECT_EQ(run({"info", database_}).code, 0);
}

TEST_F(BadInput, DatabaseOfANewerVersion) {
  const auto set_version = [&](int version) {
    sqlite3* raw = nullptr;
    ASSERT_EQ(sqlite3_open(database_.c_str(), &raw), SQLITE_OK);
    const std::string sql = "PRAGMA user_version = " + std::to_string(version);
    ASSERT_EQ(sqlite3_exec(raw, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK);
    sqlite3_close(raw);
  };
  sqlite3* raw = nullptr;
  ASSERT_EQ(sqlite3_open(database_.c_str(), &raw), SQLITE_OK);
  sqlite3_stmt* s = nullptr;
  sqlite3_prepare_v2(raw, "PRAGMA user_version", -1, &s, nullptr);
  sqlite3_step(s);
  const int current = sqlite3_column_int(s, 0);
  sqlite3_finalize(s);
  sqlite3_close(raw);
  set_version(99);
  for (const Words& words : {Words{"info", database_}, Words{"import", database_, make(other())}})
    EXPECT_SAYS(complaint(run(words)), "a newer Patchwork (schema 99)");
  set_version(current);
  EXPECT_EQ(content_hash(database_), before_);
}

TEST_F(BadInput, TextFileAsDatabase) {
  const std::string path = in_directory("notes.txt"), text(2000, 'a'), tif = make(other());
  write_text(path, text);
  for (const Words& words :
       {Words{"info", path}, Words{"import", path, tif}, Words{"query", path, "--error", "0"}})
    EXPECT_SAYS(complaint(run(words)), "notes.txt: it is not a database");
  EXPECT_EQ(text_of(path), text);
}

TEST_F(BadInput, DatabaseCutShort) {
  const auto size = std::filesystem::file_size(database_);
  std::filesystem::resize_file(database_, size / 2);
  const Outcome o = run({"sample", database_}, {.input = "500105 4999895\n"});
  EXPECT_SAYS(complaint(o), "hills.pwk");
  EXPECT_EQ(lines_of(complaint(o)).size(), 1u);
}

TEST_F(BadInput, NoDatabaseOrAFolder) {
  for (const char* verb : {"list", "info", "sample"})
    EXPECT_SAYS(complaint(run({verb, in_directory("none.pwk")})), "there is no such database");
  EXPECT_FALSE(std::filesystem::exists(in_directory("none.pwk"))) << "asking does not make one";
  EXPECT_SAYS(complaint(run({"info", in_directory("")})), "it is a folder");
}

// Who may not write may still read; importing says what is wrong.
TEST_F(BadInput, ReadOnlyFolderOrFile) {
  const std::string folder = in_directory("shelf"), db = folder + "/shelf#1?.pwk", tif = make(other());
  std::filesystem::create_directory(folder);
  std::filesystem::copy_file(database_, db);
  const std::string program = in_directory("patchwork");  // where a person without root's rights may run it
  std::filesystem::copy_file(PATCHWORK_EXECUTABLE, program);
  chmod(in_directory("").c_str(), 0755);
  chmod(folder.c_str(), 0555);
  const Circumstances person{.in_child = give_up_root};
  const Outcome info = run_program(program, {"info", db, "--json"}, person);
  EXPECT_EQ(info.code, 0) << info.err;
  EXPECT_SAYS(info.out, before_);
  EXPECT_SAYS(complaint(run_program(program, {"import", db, tif}, person)),
              "make the file and its folder writable");
  EXPECT_SAYS(complaint(run_program(program, {"import", folder + "/new.pwk", tif}, person)),
              "check the path and its folder");
  EXPECT_FALSE(std::filesystem::exists(folder + "/new.pwk"));
  chmod(folder.c_str(), 0777);
  const std::string alone = folder + "/alone.pwk";  // a file that is read-only itself
  std::filesystem::copy_file(database_, alone);
  chmod(alone.c_str(), 0444);
  EXPECT_SAYS(complaint(run_program(program, {"import", alone, tif}, person)), "writable");
  chmod(db.c_str(), 0666);
  EXPECT_EQ(run_program(program, {"import", db, tif, "--quiet"}, person).code, 0) << "the same, writable";
}

}  // namespace patchwork
