"""Every vendor's modules against what the rooms ask of a vendor; type checkers read this, and nothing runs."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pidcfg.conversion import click, dl06, dpide, ezlogix, generic, nextopid
    from pidcfg.conversion.operation import Source, Target
    from pidcfg.encoders.click import files as click_files
    from pidcfg.encoders.click import image as click_image
    from pidcfg.encoders.contract import Encoder, Files, Tables
    from pidcfg.encoders.dl06 import files as dl06_files
    from pidcfg.encoders.dl06 import image as dl06_image
    from pidcfg.encoders.dpide import files as dpide_files
    from pidcfg.encoders.dpide import image as dpide_image
    from pidcfg.encoders.ezlogix import files as ezlogix_files
    from pidcfg.encoders.ezlogix import image as ezlogix_image
    from pidcfg.encoders.generic import files as generic_files
    from pidcfg.encoders.generic import image as generic_image
    from pidcfg.encoders.maps import click as click_maps
    from pidcfg.encoders.maps import dl06 as dl06_maps
    from pidcfg.encoders.maps import dpide as dpide_maps
    from pidcfg.encoders.maps import ezlogix as ezlogix_maps
    from pidcfg.encoders.maps import generic as generic_maps
    from pidcfg.encoders.maps import nextopid as nextopid_maps
    from pidcfg.encoders.nextopid import files as nextopid_files
    from pidcfg.encoders.nextopid import image as nextopid_image
    from pidcfg.live.reading import RegisterEncoder
    from pidcfg.sim.controllers.click import scan as click_scan
    from pidcfg.sim.controllers.dl06 import scan as dl06_scan
    from pidcfg.sim.controllers.dpide import scan as dpide_scan
    from pidcfg.sim.controllers.ezlogix import scan as ezlogix_scan
    from pidcfg.sim.controllers.generic import scan as generic_scan
    from pidcfg.sim.controllers.nextopid import scan as nextopid_scan
    from pidcfg.sim.controllers.plc import Controller

    REGISTER_ENCODERS: tuple[RegisterEncoder, ...] = (click_image, dl06_image, ezlogix_image)
    ENCODERS: tuple[Encoder, ...] = (*REGISTER_ENCODERS, dpide_image, generic_image, nextopid_image)
    FILES: tuple[Files, ...] = (
        click_files,
        dl06_files,
        dpide_files,
        ezlogix_files,
        generic_files,
        nextopid_files,
    )
    TABLES: tuple[Tables, ...] = (click_maps, dl06_maps, dpide_maps, ezlogix_maps, generic_maps, nextopid_maps)
    SOURCES: tuple[Source, ...] = (click, dl06, dpide, ezlogix, generic, nextopid)
    TARGETS: tuple[Target, ...] = (click, dl06, dpide, ezlogix, generic, nextopid)
    CONTROLLERS: tuple[Controller, ...] = (
        click_scan,
        dl06_scan,
        dpide_scan,
        ezlogix_scan,
        generic_scan,
        nextopid_scan,
    )
