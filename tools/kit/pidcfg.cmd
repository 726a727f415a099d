@echo off
rem pidcfg without a network. Drop a YAML file or a folder on this file, and its report opens. A double click opens
rem a prompt in which pidcfg works;  pidcfg COMMAND ...  runs a command.
setlocal DisableDelayedExpansion
set "PYTHONUTF8=1"
set "FOUND=py -3"
%FOUND% -c "" >nul 2>nul
if not errorlevel 1 goto start
set "FOUND=python"
%FOUND% -c "" >nul 2>nul
if not errorlevel 1 goto start
echo pidcfg needs Python 3.11 or newer, and there is none on this computer.
echo Install it from the installer that your IT gives you, or take the folder that runs without Python.
pause
exit /b 9
:start
%FOUND% "%~dp0start.py" %*
exit /b %errorlevel%
