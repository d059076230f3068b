"""The datasets that scenarios and tests of the project read: where each file is published, and its checksum."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DatasetFile:
    """One file of a dataset.

    Attributes:
        path: Where the file lies below the dataset's own folder, with ``/``.
        url: Where it is downloaded from.
        size: Its length, bytes.
        sha256: Its checksum, in hexadecimal digits.
    """

    path: str
    url: str
    size: int
    sha256: str


@dataclass(frozen=True)
class Dataset:
    """Files that are downloaded together.

    Attributes:
        name: The name in ``dataset:NAME/FILE``, and of the folder that holds the files.
        what: What it is, in a few words.
        licence: Under which terms its publishers give it, and who asks for credit.
        source: The repositories it comes from.
        files: What it consists of.
    """

    name: str
    what: str
    licence: str
    source: str
    files: tuple[DatasetFile, ...]

    @property
    def size(self) -> int:
        """Length of all files together, bytes."""
        return sum(file.size for file in self.files)


def _github(
    repository: str, commit: str, folder: str, *rows: tuple[str, int, str], to: str = ""
) -> tuple[DatasetFile, ...]:
    """Files in a folder of a repository at a commit: rows of name, size and sha256. ``to`` is their folder here."""
    base = f"https://raw.githubusercontent.com/{repository}/{commit}/{folder}"
    return tuple(DatasetFile(to + name, base + name, size, sha256) for name, size, sha256 in rows)


DATASETS = (
    Dataset(
        name="lidar_radish",
        what="twelve drives of real robots with a planar laser, raw odometry and the poses of GMapping (gzipped)",
        licence="made public in Radish, The Robotics Data Set Repository, without further terms; GPL-3.0 for the"
        " repository",
        source="github.com/acschaefer/ple",
        files=(
            *_github(
                "acschaefer/ple",
                "cfcb5a7f12a793b616357381a688cfcc26eed347",
                "data/carmen/",
                (
                    "acapulco-corrected.log.gz",
                    435_137,
                    "fbd19a018534dee751606a9520fd6be25c86f3d7f1f7d849b1834d047b330116",
                ),
                ("aces-corrected.log.gz", 202_430, "5434d44384166250608a64d3a8c32de84512f82c46cb60a2657f138592024569"),
                (
                    "belgioioso-corrected.log.gz",
                    224_730,
                    "a130e3e6d9e5ec5e6a7f94cbb5cb6bca2df2626c7ed6bebb7b7a282253b10f6e",
                ),
                ("csail-corrected.log.gz", 215_275, "a98de24fc319651f231f9a8625b78bf1972312b86f7b00d2ddc979c4ac92ae2d"),
                (
                    "edmonton-corrected.log.gz",
                    194_337,
                    "96599a91e0cc9cb2570dbb92f92bbdf1e3a405b16aa99f6d3ce1a703011befdb",
                ),
                ("fhw-corrected.log.gz", 248_123, "4233abbfbc15baaddc730aceb3482dc660b25c9d5757005fff97a3fe083595b8"),
                (
                    "freiburg-079-corrected.log.gz",
                    2_043_193,
                    "0631d30baf4b9d1d209af47da9096e876e1b4cb3d5a2d68ef9c39c5a2360a466",
                ),
                (
                    "freiburg-101-corrected.log.gz",
                    223_460,
                    "7792de88bcb050f8edba92914aea75e8ec2fb73b483c01903bd2753aa655e982",
                ),
                (
                    "freiburg-campus-corrected.log.gz",
                    1_318_057,
                    "534fae978c3a28fd9994c9b3327a36a2752df8339e232b9b70f96f67f76341b0",
                ),
                (
                    "infinite-corridor-corrected.log.gz",
                    600_141,
                    "6a63c51eb97aa4e720fe207e91f926c283f77b4c534903983f9c5a6cbed6ebc4",
                ),
                ("intel-corrected.log.gz", 448_366, "71bef16e9926506cf7417995ef35ace09dbd5de067fd042a3aab85188b5480dc"),
                (
                    "seattle-corrected.log.gz",
                    396_241,
                    "5719198036b788d78a877ca04efdbfb07c2518508310f51d49c198bf1956bb4b",
                ),
            ),
        ),
    ),
    Dataset(
        name="maps_nav2_turtlebot",
        what="maps of simulated places (depot, warehouse, sandbox), and small maps of unit tests",
        licence="Apache-2.0 (nav2_bringup, TurtleBot3); BSD-3-Clause and Apache-2.0 (nav2_costmap_2d, nav2_map_server)",
        source="github.com/ros-navigation/navigation2, github.com/ROBOTIS-GIT/turtlebot3",
        files=(
            *_github(
                "ros-navigation/navigation2",
                "a3a97043ee93d92fe8d70ec56d183933169beb1c",
                "nav2_bringup/maps/",
                ("depot.pgm", 185_443, "71bbac79cfc2f5db89095182bfa86b29d96b07d4ed3b7726e513ed57afffc851"),
                ("depot.yaml", 120, "fc724e706bfb453a5c4bf513644f754130be27b618e59d75293ead1b7e129bf6"),
                ("depot_keepout.pgm", 185_487, "7423bc58822d91f22e80264eedf76ef941c9f8ca9ab92612545dac8c6385084d"),
                ("depot_keepout.yaml", 128, "ac96a51b04afe111b9f0dad7e27211cae2fad1f5406966e3a7d0e18443999923"),
                ("tb3_sandbox.pgm", 147_512, "0103b9dfaa3b79592af71cc35d64f69cfbd3565d173160820ad8ef56cd27b3fc"),
                ("tb3_sandbox.yaml", 138, "2a284eba0a3aa4a904bce71734c56a543e979899f1cf34daad6e8215e608b438"),
                ("warehouse.pgm", 1_684_107, "934ce2ca1feacc2216b68142349c6ebb3e46cc7c76fd80a9c2d2a6fb85ba7ff7"),
                ("warehouse.yaml", 125, "ec00d3d25912028e3debed9ded3d6471f70a3bf0f0d1a3f9470458f3068cc585"),
            ),
            *_github(
                "ros-navigation/navigation2",
                "a3a97043ee93d92fe8d70ec56d183933169beb1c",
                "nav2_costmap_2d/test/map/",
                ("TenByTen.pgm", 152, "f23c10b23b968807ca8c3dff53b7793c05f472fdab15603bfd2724eac2834322"),
                ("TenByTen.yaml", 103, "aaafec9257371f29edc9e747222542411b632886e790088714159867b288b5b5"),
            ),
            *_github(
                "ros-navigation/navigation2",
                "a3a97043ee93d92fe8d70ec56d183933169beb1c",
                "nav2_map_server/test/",
                ("testmap.pgm", 113, "c4d3636a574bf5de43834b897b1cf9d99e5a816b1d79facc6c58314c19a41ace"),
                ("testmap.png", 188, "52950f5ae6853d0f02c601e9014da66925a2844a0217474f3f43868452ae1adb"),
                ("testmap.yaml", 128, "7fd81c5102d940b35ee2c55bca9c9d84adcd91a1cd642ef6f26b63acf4489976"),
            ),
            *_github(
                "ROBOTIS-GIT/turtlebot3",
                "da785b7201d317e6e2a662e41bb3d3fd50ebd503",
                "turtlebot3_navigation2/map/",
                ("map.pgm", 147_508, "57eaad9291fcf02e068cbcd1874990694838a74a3304755bae1bd7b726c4522f"),
                ("map.yaml", 131, "964566f958dbee800d2e9961cb438476218526f4363b5fe550b9ea962efe584b"),
                to="turtlebot3/",
            ),
        ),
    ),
    Dataset(
        name="maps_real_slam",
        what="maps of two floors that a robot made at Osnabrueck University",
        licence="BSD (package.xml of uos/calvin_navigation)",
        source="github.com/uos/calvin_navigation",
        files=(
            *_github(
                "uos/calvin_navigation",
                "57259dfe8f8e71758c93c841077aeb0869e1ee67",
                "calvin_navigation_experiments/maps/",
                (
                    "avz3floor_complete.pgm",
                    1_044_055,
                    "57604d9c81eacaa02add4949cadf6b38616c7601c6884404652d14b185d53e70",
                ),
                ("avz3floor_complete.yaml", 130, "7cf3fb54fe234b288076df388181ab9cc895a950b09cb2ecbf43988f3af9c923"),
                (
                    "avz5floor_open_elevatoredit.pgm",
                    431_511,
                    "0d437b549c0d78b3ed34a8115e77f62829558c477ad5d2bf4de455f6e81e4d7d",
                ),
                (
                    "avz5floor_open_elevatoredit.yaml",
                    150,
                    "627270246880d9e8d08181a0dcbe5e86346c90adc1d181608bc56a1c1bba531b",
                ),
            ),
        ),
    ),
    Dataset(
        name="peds_eth",
        what="recorded pedestrians: ETH eth and hotel, 2.5 positions per second, and who walks together",
        licence="free for use with credit to the authors: Pellegrini, Ess, Schindler, van Gool, You'll Never Walk"
        " Alone, ICCV 2009; MIT for the repository",
        source="github.com/crowdbotp/OpenTraj",
        files=(
            *_github(
                "crowdbotp/OpenTraj",
                "97ec1d5e1b579f26febeaa9083705952deac338a",
                "datasets/ETH/",
                ("seq_eth/obsmat.txt", 1_158_040, "d452ae2185ecb1164c2fdf31e75f6236f4c2ffc02c751a6b2ae921740cbc60d1"),
                ("seq_eth/groups.txt", 691, "adc0347d1c6d969cd41b429cabca1bf462c0b240357d155ec3a5140a2d674893"),
                ("seq_hotel/obsmat.txt", 850_720, "2b8577595204a6b780b80258fd50da35adb7293e3e06ad6f8e1b60965e7dde6e"),
                ("seq_hotel/groups.txt", 360, "96adeafaf0a4e4e86ed446f5865b990d67554059d5c47a4add4bbaa83cbd801a"),
            ),
        ),
    ),
    Dataset(
        name="peds_eth_ucy",
        what="recorded pedestrians: UCY zara01 and students03, 2.5 positions per second, and who walks together",
        licence="free for use with credit to the authors: Lerner, Chrysanthou, Lischinski, Crowds by Example, Computer"
        " Graphics Forum, 2007; MIT for the repositories",
        source="github.com/crowdbotp/OpenTraj, github.com/abduallahmohamed/Social-STGCNN",
        files=(
            *_github(
                "crowdbotp/OpenTraj",
                "97ec1d5e1b579f26febeaa9083705952deac338a",
                "datasets/UCY/",
                ("zara01/obsmat.txt", 632_141, "bd999ebcfbc506821fa5032a10b9101e150defcff85f1ef037d09ce7c6a8c2aa"),
                (
                    "students03/obsmat.txt",
                    2_752_596,
                    "d9fd7048eab7d3d9550d7ac4f59b19d97a87612310e8c8e48cf3aaf59764ff80",
                ),
                ("zara01/groups.txt", 339, "13e43c938e01cd8c3dca4e3144aa0acaf6adfe75c4374bc41bbfbfbc199b3a89"),
                ("students03/groups.txt", 1_188, "93f1c1d59e089de38ca9d3a81d1592f8add87fac92130abdedcc3a8267177e02"),
            ),
            *_github(
                "abduallahmohamed/Social-STGCNN",
                "333d3a57b4d2705e129b21aefefa09c79b2b9ae1",
                "datasets/raw/all_data/",
                ("crowds_zara01.txt", 205_711, "1147a1962a09abfb86f28c6cddcac862e095a0cf129b3016385b69eacdd09d85"),
                ("students003.txt", 724_279, "e25798b660634330aa89f8bb259425de720e84d0873902726c1d1f4ccff21d6c"),
                to="text/",
            ),
        ),
    ),
    Dataset(
        name="ref_enclosing_circle",
        what="6144 points on one circle, with known centre and radius",
        licence="Apache-2.0",
        source="github.com/hbf/miniball",
        files=(
            *_github(
                "hbf/miniball",
                "d3d44fa04d03fd5b07d1217a1014034311308397",
                "java/src/test/resources/com/dreizak/miniball/highdim/data/",
                (
                    "cocircular_points_small_radius_2.data",
                    121_540,
                    "3778762d21ca2be375ede7b4f67954cde85bb4a52db8558a38fa1f94d305e109",
                ),
            ),
        ),
    ),
)
"""Every dataset there is, by name."""
