"""Builds the package; `ros2 run go2_high_five high_five_demo` finds its executable."""

from setuptools import setup

NAME = "go2_high_five"

setup(
    name=NAME,
    version="0.1.0",
    packages=[NAME, "scripts"],
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    zip_safe=True,
    maintainer="go2-wbc",
    maintainer_email="go2-wbc@example.com",
    description="A Go2 that stands, sits, walks and gives a high five, behind one class",
    license="Apache-2.0",
    entry_points={"console_scripts": ["high_five_demo = scripts.high_five_demo:main"]},
)
