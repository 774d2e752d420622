// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/formats/internal/label_names.h>
#include <palpate/volume/printable.h>

#include <array>
#include <cstdint>
#include <random>
#include <stdexcept>
#include <string>

#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"

namespace palpate {
namespace {

using test::make_file;
using test::TemporaryFolder;

internal::LabelNames names_of(const std::string& text) {
    const TemporaryFolder folder;
    make_file(folder / "names.txt", text);
    return internal::read_label_names(folder / "names.txt");
}

/// What reading that text says, without the folder's name.
std::string refusal(const std::string& text) {
    const TemporaryFolder folder;
    make_file(folder / "names.txt", text);
    try {
        internal::read_label_names(folder / "names.txt");
    } catch (const std::runtime_error& error) {
        const std::string message = error.what();
        EXPECT_EQ(message.find(folder.path().string()), 0U) << message;
        EXPECT_EQ(message.find('\n'), std::string::npos) << message;
        EXPECT_NE(message.find("; "), std::string::npos) << "no remedy: " << message;
        return message.substr(folder.path().string().size() + 1);
    }
    return "was read";
}

using Color = std::array<std::uint8_t, 3>;

TEST(LabelNames, LinesOfValueAndNameLeaveOutWhatFollows) {
    // As AAL's: carriage returns, a third column, an empty last line.
    const internal::LabelNames names =
        names_of("1 Precentral_L 2001\r\n2   Precentral_R\t2002\r\n116 Vermis_10 9170\r\n\r\n");
    ASSERT_EQ(names.size(), 3U);
    EXPECT_EQ(names.at(1).name, "Precentral_L");
    EXPECT_EQ(names.at(2).name, "Precentral_R");
    EXPECT_EQ(names.at(116).name, "Vermis_10");
    EXPECT_FALSE(names.at(1).color);
}

TEST(LabelNames, ANumberThatTellsNamesApartBelongsToThem) {
    const internal::LabelNames names = names_of("1 Rib 1\n2 Rib 2\n3 Precentral_L 2001\n");
    EXPECT_EQ(names.at(1).name, "Rib 1");
    EXPECT_EQ(names.at(2).name, "Rib 2");
    EXPECT_EQ(names.at(3).name, "Precentral_L");
}

// Found by the fuzz target of tables: a line of a form feed ended the process.
TEST(LabelNames, ALineOfBlanksOfAnyKindIsPassedOver) {
    const internal::LabelNames names = names_of("1 bone\n\f\n \v\t\n2 skin\n");
    ASSERT_EQ(names.size(), 2U);
    EXPECT_EQ(names.at(2).name, "skin");
}

TEST(LabelNames, BlanksBelongToANameInQuotesBetweenTabsOrBeforeFurtherWords) {
    const internal::LabelNames names = names_of("1 \"Left  Area 4\" 2001\n"
                                                "2\tRight Area 4\t2002\n"
                                                "3 Third ventricle\n"
                                                "4\t\tIn the middle\n"
                                                "-5 Negative\n"
                                                "6\tUnclassified\n");
    EXPECT_EQ(names.at(1).name, "Left  Area 4");
    EXPECT_EQ(names.at(2).name, "Right Area 4");
    EXPECT_EQ(names.at(3).name, "Third ventricle");
    EXPECT_EQ(names.at(4).name, "In the middle");
    EXPECT_EQ(names.at(-5).name, "Negative");
    EXPECT_EQ(names.at(6).name, "Unclassified");
}

TEST(LabelNames, CommentsBlankLinesAndAByteOrderMarkArePassedOver) {
    const internal::LabelNames names =
        names_of("\xEF\xBB\xBF# a table\n\n   \t \n  # more\n7 Here\n");
    ASSERT_EQ(names.size(), 1U);
    EXPECT_EQ(names.at(7).name, "Here");
}

TEST(LabelNames, FreeSurferAndSlicerTablesBringColours) {
    const internal::LabelNames names = names_of("#No. Label Name:  R G B A\n"
                                                "0   Unknown                 0   0   0   0\n"
                                                "17  Left-Hippocampus      220 216  20   0\n"
                                                "18\tLeft-Amygdala\t\t103\t255 255\t255\n"
                                                "19  Left Insula 80 196 98 0\n");
    EXPECT_EQ(names.at(17).name, "Left-Hippocampus");
    EXPECT_EQ(names.at(17).color, (Color{220, 216, 20}));
    EXPECT_EQ(names.at(18).name, "Left-Amygdala");
    EXPECT_EQ(names.at(18).color, (Color{103, 255, 255}));
    EXPECT_EQ(names.at(19).name, "Left Insula");
    EXPECT_EQ(names.at(19).color, (Color{80, 196, 98}));
    EXPECT_EQ(names.at(0).name, "Unknown");
}

TEST(LabelNames, ItkSnapTablesHaveTheNameLast) {
    const internal::LabelNames names =
        names_of("################################################\n"
                 "# IDX   -R-  -G-  -B-  -A--  VIS MSH  LABEL\n"
                 "    0     0    0    0        0  0  0    \"Clear Label\"\n"
                 "    1   255    0   12        1  1  1    \"Caudate nucleus, left\"\n"
                 "    2     0  255    0     0.51  1  1    \"2\"\n");
    EXPECT_EQ(names.at(1).name, "Caudate nucleus, left");
    EXPECT_EQ(names.at(1).color, (Color{255, 0, 12}));
    EXPECT_EQ(names.at(2).name, "2");
}

TEST(LabelNames, ColumnNamesSayWhereIndexNameAndColourAre) {
    const internal::LabelNames names = names_of("name\tabbreviation\tindex\tcolor\r\n"
                                                "Gray Matter\tGM\t1\t#ff53bb\r\n"
                                                "\"White Matter\"\tWM\t2\tn/a\r\n"
                                                "n/a\tX\t3\t#000000\r\n"
                                                "CSF\t\t4\r\n");
    ASSERT_EQ(names.size(), 3U);
    EXPECT_EQ(names.at(1).name, "Gray Matter");
    EXPECT_EQ(names.at(1).color, (Color{0xff, 0x53, 0xbb}));
    EXPECT_EQ(names.at(2).name, "White Matter");
    EXPECT_FALSE(names.at(2).color);
    EXPECT_EQ(names.at(4).name, "CSF");
}

TEST(LabelNames, ValuesThatNoLabelVolumeHoldsArePassedOver) {
    const internal::LabelNames names = names_of("1 Here\n614454277 Far\n99999999999999 Beyond\n");
    EXPECT_EQ(names.at(614454277).name, "Far");
    EXPECT_EQ(names.size(), 2U);
}

TEST(LabelNames, AMessageHasTheLineNumber) {
    EXPECT_EQ(refusal("1 One\r\n2 Two\r\nthree Three\r\n")
                  .find("names.txt:3: begins with "
                        "\"three\""),
              0U);
    EXPECT_EQ(refusal("1 One\n\n2\n").find("names.txt:3: names nothing for 2"), 0U);
    EXPECT_EQ(refusal("1 One\r2 Two\r1.5 Half\r").find("names.txt:3: begins with \"1.5\""), 0U);
    EXPECT_EQ(refusal("1 \"One\n").find("names.txt:1: opens a quote"), 0U);
    EXPECT_EQ(refusal("1 \"\"\n").find("names.txt:1: gives 1 an empty name"), 0U);
    EXPECT_EQ(refusal("nan Nothing\n").find("names.txt:1:"), 0U);
    EXPECT_EQ(refusal("index\tname\n1\tOne\nx\tTwo\n").find("names.txt:3: has the index \"x\""),
              0U);
    EXPECT_EQ(refusal("color\tindex\tname\n#000000\t1\n").find("names.txt:2: has 2 fields"), 0U);
}

TEST(LabelNames, AValueHasOneName) {
    EXPECT_EQ(refusal("1 One\n2 Two\n1 Uno\n")
                  .find("names.txt:3: names 1 \"Uno\", but above it is "
                        "\"One\""),
              0U);
    EXPECT_EQ(names_of("1 One\n1 One\n").size(), 1U); // the same twice is no contradiction
}

TEST(LabelNames, WhatIsNoTableIsRefused) {
    EXPECT_EQ(refusal("").find("names.txt: names no label"), 0U);
    EXPECT_EQ(refusal("# nothing but this\n").find("names.txt: names no label"), 0U);
    EXPECT_EQ(refusal(std::string("\xFF\xFE\x31\0\x20\0", 6)).find("names.txt: is UTF-16"), 0U);
    EXPECT_EQ(refusal(std::string(17 << 20, '1')).find("names.txt: is too large"), 0U);
    const TemporaryFolder folder;
    EXPECT_THROW(internal::read_label_names(folder.path()), std::runtime_error);
    EXPECT_THROW(internal::read_label_names(folder / "none.txt"), std::runtime_error);
}

TEST(LabelNames, GarbageIsReadOrRefusedInOneLine) {
    SCOPED_TRACE("seed 21");
    std::mt19937 random(21);
    const std::string alphabet = "0123 \t\"#\n\r.-ab\xC3\xA9\xFF\0";
    std::uniform_int_distribution<std::size_t> letter(0, alphabet.size());
    std::uniform_int_distribution<int> length(0, 60);
    for (int n = 0; n < 150; ++n) {
        std::string text = n % 3 == 0 ? "index\tname\n" : "";
        for (int left = length(random); left > 0; --left)
            text += alphabet.c_str()[letter(random)];
        if (const std::string said = refusal(text); said != "was read") {
            EXPECT_EQ(said.find("names.txt"), 0U);
        }
    }
}

TEST(LabelNames, NamesAreShownWithoutWhatATerminalWouldObey) {
    EXPECT_EQ(printable("  Gyrus frontalis \t"), "Gyrus frontalis");
    EXPECT_EQ(printable("N\xC3\xA9oplasie \xE8\x84\xB3 \xF0\x9F\xA7\xA0"),
              "N\xC3\xA9oplasie \xE8\x84\xB3 \xF0\x9F\xA7\xA0");
    EXPECT_EQ(printable("a\x1B[31mb\x7F"), "a?[31mb?");
    EXPECT_EQ(printable("Gr\xF6\xDF"
                        "e"),
              "Gr??e"); // Latin-1
    EXPECT_EQ(printable("\xC0\xAF \xED\xA0\x80 \xC2\x85 \xE8\x84"), "?? ??? ?? ??");
    EXPECT_EQ(names_of("1 Gr\xF6sse\n").at(1).name, "Gr?sse");
}

} // namespace
} // namespace palpate
